#include "demosaicker.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "ahd.h"
#include "bilinear.h"

namespace demosaic {

namespace {
// The sizes for which schedules are made; the compiled code handles all sizes.
constexpr int usual_width = 1024, usual_height = 1024;
constexpr uint64_t cache_bytes = 32 << 20;
}  // namespace

lang::MachineParams machine_of(int threads) {
  return {threads, cache_bytes, lang::MachineParams().balance};
}

void schedule_and_compile(lang::Pipeline& pipeline, int threads) {
  const auto target = lang::get_jit_target_from_environment();
  pipeline.auto_schedule(target, machine_of(threads));
  pipeline.compile_jit(target);
}

std::string name_of(const Shape& shape) {
  return retrograde::text("relaxed ", shape.filters, " ", shape.size, "x", shape.size);
}

Demosaicker::Demosaicker(std::string name, int threads)
    : name_(std::move(name)), threads_(threads) {}

Demosaicker Demosaicker::bilinear(int threads) {
  Demosaicker result("bilinear", threads);
  result.compile(demosaic::bilinear(lang::BoundaryConditions::mirror_interior(result.mosaic_)));
  return result;
}

Demosaicker Demosaicker::ahd(int threads) {
  Demosaicker result("AHD", threads);
  result.compile(Ahd(lang::BoundaryConditions::mirror_interior(result.mosaic_)).image);
  return result;
}

Demosaicker Demosaicker::relaxed(const Weights& weights, int threads) {
  Demosaicker result(name_of(weights.shape), threads);
  result.model_ = std::make_shared<Relaxed>(
      weights.shape, lang::BoundaryConditions::mirror_interior(result.mosaic_));
  result.use(weights);
  result.compile(result.model_->image);
  return result;
}

void Demosaicker::use(const Weights& weights) {
  weights_ = std::make_shared<Weights>(weights);
  weights_->bind(model_->parameters);
}

void Demosaicker::compile(lang::Func image) {
  image.set_estimates({{0, usual_width}, {0, usual_height}, {0, 3}});
  pipeline_ = lang::Pipeline(image);
  schedule_and_compile(pipeline_, threads_);
}

void Demosaicker::run_into(std::vector<float>& mosaic, int width, int height,
                           std::vector<float>& planes) {
  mosaic_.set(lang::Buffer<float>(mosaic.data(), width, height));
  const lang::Buffer<float> image(planes.data(), width, height, 3);
  pipeline_.realize(lang::Realization(std::vector<lang::Buffer<>>{image}));
}

std::vector<float> Demosaicker::run(std::vector<float>& mosaic, int width, int height) {
  std::vector<float> planes(3 * mosaic.size());
  run_into(mosaic, width, height, planes);
  return planes;
}

double Demosaicker::ms_per_megapixel(std::vector<float>& mosaic, int width, int height, int runs) {
  std::vector<float> planes(3 * mosaic.size());
  std::vector<double> ms;
  for (int run = 0; run <= runs; ++run) {
    const auto start = std::chrono::steady_clock::now();
    run_into(mosaic, width, height, planes);
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    if (run > 0) ms.push_back(taken.count());  // the first run has cold caches
  }
  std::nth_element(ms.begin(), ms.begin() + static_cast<long>(ms.size() / 2), ms.end());
  return ms[ms.size() / 2] * 1e6 / static_cast<double>(mosaic.size());
}

}  // namespace demosaic

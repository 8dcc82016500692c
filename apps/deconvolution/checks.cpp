// checks.cpp -- see checks.h.
#include "checks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <span>

#include "common/report.h"
#include "inexact.h"
#include "training.h"

namespace deconvolution {

namespace {

constexpr BatchShape small_batch{.side = 14, .pieces = 2, .psf = 5};
constexpr Shape small_shape{.filters = 6, .size = 3, .bumps = 4};
constexpr int small_stages = 2;

// A point away from the initial one, at which parts of the gradient are 0. Its weights are large enough for conjugate
// gradients to converge to the last digits: smaller weights need more iterations, and float32 holds less of the
// minimum.
Weights well_posed(uint64_t seed) {
  constexpr double shake = 0.2, log_weight = -1;
  Weights weights = learning_start(small_shape, small_stages);
  Random random(seed);
  for (float& value : weights.values) value += static_cast<float>(shake * (random.uniform() - 0.5));
  for (int stage = 0; stage < weights.stages; ++stage) {
    for (float& value : weights.of(stage, Array::LogWeights))
      value = static_cast<float>(log_weight + 0.5 * random.uniform());
  }
  return weights;
}

std::vector<double> widened(const std::vector<float>& values) {
  return {values.begin(), values.end()};
}

// Evaluates the loss and its gradient in one precision.
template <typename T>
class Evaluator {
 public:
  Evaluator(const Accuracy& accuracy, int threads)
      : objective_(small_shape, small_batch.extent(), threads) {
    objective_.set(accuracy);
  }

  void set(const Simulated& batch) { objective_.set(batch); }
  double loss(const std::vector<double>& at) {
    const std::vector<T> numbers(at.begin(), at.end());
    return objective_.evaluate(std::span<const T>(numbers), {}, all_);
  }
  double evaluate(std::span<const double> at, std::vector<double>& gradient) {
    const std::vector<T> numbers(at.begin(), at.end());
    std::vector<T> own(numbers.size());
    const double loss = objective_.evaluate(std::span<const T>(numbers), own, all_);
    gradient.assign(own.begin(), own.end());
    return loss;
  }
  std::vector<double> image() const {
    return {objective_.image().begin(), objective_.image().end()};
  }

 private:
  static constexpr Range all_{0, small_stages - 1};
  Objective<T> objective_;
};

// The positions of an array's numbers, stage by stage.
std::vector<size_t> places_of(Array array) {
  std::vector<size_t> places;
  for (int stage = 0; stage < small_stages; ++stage) {
    size_t from = static_cast<size_t>(stage) * elements_of(small_shape);
    for (const Array before : all_arrays) {
      if (before == array) break;
      from += elements_of(small_shape, before);
    }
    for (size_t k = 0; k < elements_of(small_shape, array); ++k) places.push_back(from + k);
  }
  return places;
}

// Steps are small, because the cleaning has kinks where a pixel's brightness crosses a bin.
double difference_along(Evaluator<double>& exact, const std::vector<double>& at,
                        const std::vector<double>& direction) {
  return apps::difference_along([&](const auto& x) { return exact.loss(x); }, at, direction, 2e-6);
}

std::vector<double> part(const std::vector<double>& all, const std::vector<size_t>& places) {
  std::vector<double> result;
  for (const size_t place : places) result.push_back(all[place]);
  return result;
}

// The worst error relative to the resolution of differences, whose error is relative to the largest derivative along a
// direction of ones.
double worst_difference(Evaluator<double>& exact, const std::vector<double>& at,
                        const std::vector<double>& adjoint, const std::vector<size_t>& places,
                        Random& random) {
  constexpr int directions = 2;
  double worst = 0;
  for (int k = 0; k < directions; ++k) {
    std::vector<double> direction(at.size(), 0.0);
    double along = 0, scale = 0;
    for (const size_t place : places) {
      direction[place] = random.uniform(-1, 1);
      along += direction[place] * adjoint[place];
      scale += std::abs(direction[place] * adjoint[place]);
    }
    const double error =
        std::abs(along - difference_along(exact, at, direction)) / std::max(scale, 1e-300);
    if (!(error <= worst)) worst = error;
  }
  return worst;
}

}  // namespace

std::vector<apps::GradientRow> loss_gradients(const std::vector<demosaic::Photograph>& photographs,
                                              uint64_t seed, int threads) {
  const Simulated batch = Sampler(photographs, seed).draw(small_batch);
  Evaluator<double> exact({.iterations = 400, .tolerance = 1e-13}, threads);
  Evaluator<float> own({.iterations = 200, .tolerance = 1e-8}, threads);
  exact.set(batch);
  own.set(batch);
  const std::vector<double> at = widened(well_posed(seed).values);
  std::vector<double> adjoint, in_float;
  exact.evaluate(at, adjoint);
  own.evaluate(at, in_float);
  Random random(seed);
  std::vector<apps::GradientRow> rows;
  for (const Array array : all_arrays) {
    const auto places = places_of(array);
    rows.push_back(
        {"loss by " + name_of(array), worst_difference(exact, at, adjoint, places, random),
         apps::relative_error(part(in_float, places), part(adjoint, places)), "differences"});
  }
  return rows;
}

std::vector<apps::GradientRow> energy_gradients(
    const std::vector<demosaic::Photograph>& photographs, uint64_t seed) {
  const Simulated batch = Sampler(photographs, seed).draw(small_batch);
  Stage stage(small_shape, small_batch.extent());
  bind_problem<float>(stage, batch.problem);
  const Weights weights = well_posed(seed);
  bind_numbers<float>(stage, weights.of(1));
  const Extent extent = small_batch.extent();
  const std::vector<int> sizes{extent.full_width(), extent.full_height(), extent.count};
  const std::vector<float> before = padded<float>(batch.problem);
  std::vector<float> image = before;
  Random random(seed);
  for (float& value : image) value += static_cast<float>(0.05 * random.normal());
  stage.image.set(filled<float>(sizes, std::span<const float>(image)));
  stage.before.set(filled<float>(sizes, std::span<const float>(before)));
  auto rows = apps::gradient_rows(
      lang::check_gradients(stage.energy, {}, {.directions = 2, .wrt = {stage.image}}));
  for (apps::GradientRow& row : rows) row.input = "energy by " + row.input;
  return rows;
}

namespace {

// Test content of two images, as a function of position.
struct Frame {
  const char* name;
  std::function<double(int x, int y)> sample;
  double noise = usual_noise;
};

std::vector<Frame> frames() {
  const auto random = [](int x, int y) {
    return Random(static_cast<uint64_t>(1000 * (y + 100) + x + 100)).uniform();
  };
  const auto wave = [](int x, int y) { return 0.5 + 0.5 * std::sin(0.9 * x + 0.3 * y); };
  return {{"black", [](int, int) { return 0.0; }},
          {"saturated", [](int, int) { return 1.0; }},
          {"black beside saturated", [](int x, int) { return x < 7 ? 0.0 : 1.0; }},
          {"one bright sample on black", [](int x, int y) { return x == 6 && y == 6 ? 1.0 : 0.0; }},
          {"every other row saturated", [](int, int y) { return y % 2 == 0 ? 1.0 : 0.0; }},
          {"waves", wave},
          {"waves without noise to speak of", wave, 1e-4},
          {"waves in much noise", wave, 0.5},
          {"samples of 1000", [random](int x, int y) { return 1000 * random(x, y); }},
          {"noise of 1e-6 in the dark", [random](int x, int y) { return 1e-6 * random(x, y); }},
          {"noise", random}};
}

// The frame, with another frame as truth so that there is a gradient.
Simulated batch_of(const Frame& frame) {
  const Extent e = small_batch.extent();
  Simulated batch;
  batch.problem.extent = e;
  const Psf psfs[] = {enlarged(motion_path(5, 3), e.psf), enlarged(defocus_disc(1.5), e.psf)};
  Random random(5);
  for (int k = 0; k < e.count; ++k) {
    for (int y = 0; y < e.height; ++y) {
      for (int x = 0; x < e.width; ++x) {
        batch.problem.blurred.push_back(static_cast<float>(frame.sample(x, y)));
        batch.truth.push_back(static_cast<float>(random.uniform()));
      }
    }
    const auto& samples = psfs[k % 2].samples;
    batch.problem.psfs.insert(batch.problem.psfs.end(), samples.begin(), samples.end());
    batch.problem.noises.push_back(static_cast<float>(frame.noise));
  }
  return batch;
}

apps::StabilityRow stability_of(const Frame& frame, uint64_t seed, long steps,
                                Evaluator<float>& own, Evaluator<double>& exact) {
  constexpr double large_rate = 0.3;  // about sixty times the rate that learning uses for filters
  constexpr double nothing =
      1e-6;  // dB for a number that moves by 1; smaller gradients count as zero
  const Simulated batch = batch_of(frame);
  const std::vector<double> at = widened(well_posed(seed).values);
  own.set(batch);
  exact.set(batch);
  std::vector<double> in_float, in_double;
  own.evaluate(at, in_float);
  exact.evaluate(at, in_double);
  apps::StabilityRow row{frame.name,
                         apps::relative_error(own.image(), exact.image()),
                         apps::relative_error(in_float, in_double, nothing),
                         {},
                         {},
                         steps};
  const apps::Problem problem{.size = at.size(),
                              .evaluate = [&](std::span<const double> x, std::span<double> g) {
                                std::vector<double> gradient;
                                const double loss = own.evaluate(x, gradient);
                                if (!g.empty())
                                  std::copy(gradient.begin(), gradient.end(), g.begin());
                                return loss;
                              }};
  apps::measure_divergence(row, problem, at, apps::large_steps(steps, large_rate));
  return row;
}

void finish(const Options& options, const std::vector<apps::Table>& tables) {
  apps::report_tables("deconvolution", options.common, tables);
  std::printf("report in %s\n", (options.common.output / "report.json").c_str());
}

std::vector<demosaic::Photograph> photographs_of(const Options& options) {
  if (!options.common.input.empty()) return {demosaic::read_photograph(options.common.input)};
  return demosaic::read_dataset(options.dataset).train;
}

}  // namespace

std::vector<apps::StabilityRow> stability_rows(uint64_t seed, int threads, long steps) {
  constexpr Accuracy accuracy{.iterations = 60, .tolerance = 1e-6};
  Evaluator<float> own(accuracy, threads);
  Evaluator<double> exact(accuracy, threads);
  std::vector<apps::StabilityRow> rows;
  for (const Frame& frame : frames()) rows.push_back(stability_of(frame, seed, steps, own, exact));
  return rows;
}

namespace {

void check_gradients(const Options& options) {
  const auto photographs = photographs_of(options);
  auto rows = energy_gradients(photographs, options.common.seed);
  for (auto& row : loss_gradients(photographs, options.common.seed, options.common.threads))
    rows.push_back(std::move(row));
  const Weights weights =
      options.weights.empty() ? learned_weights() : read_weights(options.weights);
  finish(options,
         {apps::gradient_table(rows),
          inexact_solutions(photographs, weights, options.common.seed, options.common.threads)});
  apps::require_gradients(rows);
}

void check_stability(const Options& options) {
  constexpr long steps = 60;
  finish(
      options,
      {apps::stability_table(stability_rows(options.common.seed, options.common.threads, steps))});
}

}  // namespace

void check(const Options& options) {
  options.common.check_gradients ? check_gradients(options) : check_stability(options);
}

void explain(const Options& options) {
  const Extent extent = BatchShape{}.extent();
  const Objective<float> all(options.shape, extent, options.common.threads);
  const Objective<float> chosen(options.shape, extent, options.common.threads,
                                arrays_of(options.common.optimize));
  std::printf("%s\n", chosen.explain().c_str());
  apps::print_left_out_groups(options.common, group_names);
  std::printf("the gradient of a stage has %zu Funcs; that by every group would have %zu\n",
              chosen.stages(), all.stages());
  std::printf("left out where a picture is deconvolved: the loss, and all of this\n");
}

}  // namespace deconvolution

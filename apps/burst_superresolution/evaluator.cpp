// evaluator.cpp -- see evaluator.h.
#include "evaluator.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "demosaic/demosaicker.h"

namespace burst {

std::vector<std::string> left_out(const Shape& shape, const Smoothness& smoothness,
                                  const Moves& moves) {
  std::vector<std::string> out;
  if (shape.frames == 1)
    out.push_back("homographies and interpolation: there is one frame, which lies on the picture");
  if (smoothness.empty()) out.push_back("differences of neighbours: the smoothness has no weight");
  if (!moves.image) out.push_back("the adjoint of the picture, a scatter: it does not move");
  if (!moves.homographies && shape.frames > 1)
    out.push_back("the adjoints of places and homographies: they do not move");
  return out;
}

namespace {

// The sums of a homography's gradient read the same positions, samples and adjoints; stored, each is computed once.
// They take about ten numbers per sample, more than the scheduler stores by default. If the picture moves too, it
// stores them anyway, because the picture's scatter needs more than that.
template <typename T>
lang::AutoscheduleOptions schedule_options(const Shape& shape, const Moves& moves) {
  constexpr int64_t kept_a_sample = 10 * sizeof(T), allowed = int64_t{1} << 30;
  const auto samples = static_cast<int64_t>(shape.size.pixels()) * shape.frames;
  lang::AutoscheduleOptions options;
  if (!moves.image && kept_a_sample * samples <= allowed) options.memory_budget = allowed;
  return options;
}

}  // namespace

template <typename T>
Evaluator<T>::Evaluator(const Shape& shape, const Smoothness& smoothness, const Moves& moves,
                        int threads)
    : shape_(shape),
      moves_{moves.image, moves.homographies && shape.frames > 1},
      objective_(shape, smoothness, lang::type_of<T>()),
      adjoints_(differentiate()) {
  set_smoothness(smoothness);
  const auto start = std::chrono::steady_clock::now();
  pipeline_ = lang::Pipeline(outputs());
  const auto target = lang::get_jit_target_from_environment();
  pipeline_.auto_schedule(target, schedule_options<T>(shape, moves), demosaic::machine_of(threads));
  pipeline_.compile_jit(target);
  compile_seconds_ =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

template <typename T>
lang::Derivative Evaluator<T>::differentiate() const {
  lang::AdjointOptions options;
  if (moves_.image) options.wrt.emplace_back(objective_.image);
  if (moves_.homographies) options.wrt.emplace_back(objective_.homographies);
  return lang::propagate_adjoints(objective_.loss, options);
}

template <typename T>
std::vector<lang::Func> Evaluator<T>::outputs() const {
  std::vector<lang::Func> outputs{objective_.loss};
  if (moves_.image) outputs.push_back(adjoints_(objective_.image));
  if (moves_.homographies) outputs.push_back(adjoints_(objective_.homographies));
  return outputs;
}

template <typename T>
void Evaluator<T>::set_frames(std::span<const float> samples) {
  lang::Buffer<T> frames(std::vector<int>{shape_.size.width, shape_.size.height, shape_.frames});
  std::copy(samples.begin(), samples.end(), frames.begin());
  objective_.frames.set(frames);
}

template <typename T>
void Evaluator<T>::set_smoothness(const Smoothness& smoothness) {
  if (smoothness.empty()) return;
  lang::Buffer<T> weights(static_cast<int>(smoothness.size()));
  for (size_t a = 0; a < smoothness.size(); ++a)
    weights(static_cast<int>(a)) = static_cast<T>(smoothness[a].weight);
  objective_.weights.set(weights);
}

template <typename T>
double Evaluator<T>::evaluate(std::span<T> x, std::span<T> gradient) {
  const size_t motion = shape_.image_elems();
  objective_.image.set(lang::Buffer<T>(x.data(), image_sizes()));
  if (shape_.frames > 1)
    objective_.homographies.set(lang::Buffer<T>(x.data() + motion, motion_sizes()));
  lang::Buffer<T> loss = lang::Buffer<T>::make_scalar();
  std::vector<lang::Buffer<>> outputs{loss};
  std::fill(gradient.begin(), gradient.end(), T(0));
  if (moves_.image) outputs.push_back(lang::Buffer<T>(gradient.data(), image_sizes()));
  if (moves_.homographies)
    outputs.push_back(lang::Buffer<T>(gradient.data() + motion, motion_sizes()));
  pipeline_.realize(lang::Realization(outputs));
  std::fill_n(gradient.begin() + static_cast<long>(motion), homography_params, T(0));
  return static_cast<double>(loss());
}

template class Evaluator<float>;
template class Evaluator<double>;

}  // namespace burst

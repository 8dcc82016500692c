// deconvolver.cpp -- see deconvolver.h.
#include "deconvolver.h"

namespace deconvolution {

std::vector<Method> shipped_methods() {
  return {{"original", original()}, {"tuned", tuned_weights()}, {"learned", learned_weights()}};
}

Deconvolver::Deconvolver(Method method, const Extent& extent, int threads, const Accuracy& accuracy)
    : method_(std::move(method)),
      accuracy_(accuracy),
      solver_(method_.weights.shape, extent, threads) {}

std::vector<float> Deconvolver::run(const Problem& problem, const Watch& watch) {
  solver_.set(problem);
  stages_.clear();
  std::vector<float> images = padded<float>(problem);
  stopped_ = false;
  for (int stage = 0; stage < method_.weights.stages && !stopped_; ++stage) {
    solver_.set(std::as_const(method_.weights).of(stage));
    // A stage may end early; the iterations shown then continue from the count at which it could have ended.
    const int before = accuracy_.iterations * stage;
    images = solver_.solve(images, accuracy_, [&](const lang::Buffer<float>& now) {
      stopped_ = watch && !watch(before + solver_.iterations(), now);
      return !stopped_;
    });
    stages_.push_back(cropped(images, problem.extent));
  }
  return stages_.back();
}

}  // namespace deconvolution

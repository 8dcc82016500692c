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
  int iterations = 0;
  bool stopped = false;
  for (int stage = 0; stage < method_.weights.stages && !stopped; ++stage) {
    solver_.set(std::as_const(method_.weights).of(stage));
    images = solver_.solve(images, accuracy_, [&](const lang::Buffer<float>& now) {
      ++iterations;
      stopped = watch && !watch(iterations, now);
      return !stopped;
    });
    // A stage may end early, and what is shown goes on from where it could have ended.
    iterations = accuracy_.iterations * (stage + 1);
    stages_.push_back(cropped(images, problem.extent));
  }
  return stages_.back();
}

}  // namespace deconvolution

// shorten.h -- makes a lens shorter at the same focal length, F-number and field.
#pragma once

#include <functional>
#include <string>

#include "common/minimize.h"
#include "evaluator.h"

namespace lens {

// The outcome of one method.
struct Run {
  std::string method;
  std::vector<apps::LossSample> series;  // over all stages, in seconds of optimization
  std::vector<double> x;
  double loss = 0;
  long steps = 0, evaluations = 0, products = 0, refused = 0;
  bool stopped = false;
  int restart = 0;  // the start that led to x; 0: the lens itself
};

// The length falls in stages, each with a share of the steps, to `shorter` (0.1: 10 %) below the initial one. The loss
// of each stage demands that stage's length. `first_stage` and `x`: where a resumed run continues.
struct ShortenOptions {
  apps::Method method = apps::Method::Lbfgs;
  double shorter = 0.1;
  long steps = 300;
  double seconds = 0;
  int stages = 5;
  int first_stage = 0;
  std::vector<double> x = {};
};

// Called after each step with the stage, the number of steps so far, and the best numbers of the stage.
using ShortenCallback =
    std::function<void(int stage, long step, double loss, std::span<const double> best)>;

Run shorten(Evaluator& evaluator, const Scene& scene, const ShortenOptions& options,
            const ShortenCallback& callback = {});

// The loss has many local minima: optimizes again from `restarts` random starts and returns the best result. `callback`
// is called with the number of finished starts.
Run shorten_from_many(Evaluator& evaluator, const Scene& scene, const ShortenOptions& options,
                      int restarts, uint64_t seed, Run best,
                      const std::function<void(int restart, double best_loss)>& callback = {});

}  // namespace lens

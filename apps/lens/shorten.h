// shorten.h -- the work: a lens made shorter at the same focal length, F-number and field.
#pragma once

#include <functional>
#include <string>

#include "common/minimize.h"
#include "evaluator.h"

namespace lens {

// How one method came through.
struct Run {
  std::string method;
  std::vector<apps::LossSample> series;  // over all stages, in seconds of optimizing
  std::vector<double> x;
  double loss = 0;
  long steps = 0, evaluations = 0, products = 0, refused = 0;
  bool stopped = false;
  int restart = 0;  // which start led to x; 0: the lens itself
};

// The length falls in stages, each a share of the steps, to `shorter` (0.1: 10 %) below the start's; the
// loss of each stage asks for its own length. `first_stage`, `x`: where a run that is resumed goes on.
struct ShortenOptions {
  apps::Method method = apps::Method::Lbfgs;
  double shorter = 0.1;
  long steps = 300;
  double seconds = 0;
  int stages = 5;
  int first_stage = 0;
  std::vector<double> x = {};
};

// Called after each step with the stage, the steps so far, and the best numbers of the stage.
using ShortenCallback =
    std::function<void(int stage, long step, double loss, std::span<const double> best)>;

Run shorten(Evaluator& evaluator, const Scene& scene, const ShortenOptions& options,
            const ShortenCallback& callback = {});

// The loss has many minima: the same from `restarts` more starts, moved at random, and the best of all.
// `callback` is told how many are done.
Run shorten_from_many(Evaluator& evaluator, const Scene& scene, const ShortenOptions& options,
                      int restarts, uint64_t seed, Run best,
                      const std::function<void(int restart, double best_loss)>& callback = {});

}  // namespace lens

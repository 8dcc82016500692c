// fit.h -- the optimization: one run of each method from the same initial point. It can be stopped and resumed.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "common/state.h"
#include "control.h"
#include "options.h"

namespace fluid {

struct MethodRun {
  apps::Method method;
  std::vector<double> x;     // the current point
  std::vector<double> best;  // the best point so far
  double best_loss = std::numeric_limits<double>::infinity();
  std::vector<apps::LossSample> series = {};  // since the initial point
  long refused = 0;
  std::string ended = {};

  long steps() const { return series.empty() ? 0 : series.back().step; }
  double seconds() const { return series.empty() ? 0 : series.back().seconds; }
};

struct Fit {
  std::vector<MethodRun> runs;
  std::vector<double> gradient_seconds;  // times of all evaluations of loss and gradient
  bool stopped = false;

  const MethodRun& best() const;
  double median_gradient_seconds() const;
};

// Runs every method from `start` for options.common.steps steps, including those of earlier runs. `shown` is called
// with the method's name, its steps and its loss. Saves options.common.output / "state.bin" every twenty seconds and at
// the end.
Fit optimize(const Options& options, Control<float>& control, const std::vector<double>& start,
             const std::function<void(const std::string&, long, double)>& shown);

// Reads the force from a run's state; it must have this many elements. Throws retrograde::UserError.
std::vector<float> read_force(const std::filesystem::path& state, size_t size);

}  // namespace fluid

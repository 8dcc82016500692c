// fit.h -- the optimization: one run of each method from the same start, which can be stopped and
// gone on with.
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
  std::vector<double> x;     // where it is
  std::vector<double> best;  // the best point that it met
  double best_loss = std::numeric_limits<double>::infinity();
  std::vector<apps::LossSample> series = {};  // since the first start
  long refused = 0;
  std::string ended = {};

  long steps() const { return series.empty() ? 0 : series.back().step; }
  double seconds() const { return series.empty() ? 0 : series.back().seconds; }
};

struct Fit {
  std::vector<MethodRun> runs;
  std::vector<double> gradient_seconds;  // of each loss with its gradient
  bool stopped = false;

  const MethodRun& best() const;
  double median_gradient_seconds() const;
};

// Runs every method for options.common.steps steps, those of earlier runs counted, from `start`.
// `shown` gets the name of the method, its steps and its loss. Keeps options.common.output /
// "state.bin" as new as twenty seconds, and writes it at the end.
Fit optimize(const Options& options, Control<float>& control, const std::vector<double>& start,
             const std::function<void(const std::string&, long, double)>& shown);

// The force that a run's state holds, of this many elements. Throws retrograde::UserError.
std::vector<float> read_force(const std::filesystem::path& state, size_t size);

}  // namespace fluid

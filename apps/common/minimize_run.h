// minimize_run.h -- the state that all optimizers share during a run: counts, the best point, the stopping criteria.
#pragma once

#include <chrono>

#include "common/minimize.h"

namespace apps {

class MinimizeRun {
 public:
  // Throws retrograde::UserError if the loss or its gradient is not finite at the start.
  MinimizeRun(const Problem& problem, std::span<const double> start, const MinimizeOptions& options,
              const StepCallback& callback);

  const Problem& problem() const { return problem_; }
  const MinimizeOptions& options() const { return options_; }

  // The loss at x, and its gradient unless `gradient` is empty. If they are not finite, they count as refused.
  double evaluate(std::span<const double> x, std::span<double> gradient);
  std::vector<double> product(std::span<const double> x, std::span<const double> v);

  // Called after each step with its loss: whether to end, and records why.
  bool ends_after_step(double loss, std::span<const double> gradient);
  // Ends the run for another reason.
  void end(const std::string& reason) { found_.ended = reason; }
  bool ended() const { return !found_.ended.empty(); }

  long steps_left() const { return options_.steps - found_.steps; }
  double seconds() const;
  const Minimum& found() const { return found_; }
  Minimum take();

 private:
  void keep_best(double loss, std::span<const double> x);
  std::string reason_to_end(double loss, std::span<const double> gradient);

  const Problem& problem_;
  const MinimizeOptions& options_;
  const StepCallback& callback_;
  std::chrono::steady_clock::time_point start_;
  Minimum found_;
};

// Whether `number` and all of `numbers` are finite.
bool all_finite(double number, std::span<const double> numbers);

// Each runs to its end, starting at `x`.
void run_adam(MinimizeRun& run, std::vector<double> x);
void run_ceres(MinimizeRun& run, std::vector<double> x);      // minimize_ceres.cpp
void run_newton_cg(MinimizeRun& run, std::vector<double> x);  // newton_cg.cpp

}  // namespace apps

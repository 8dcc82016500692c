// checks.h -- the measurements and tables of --check-gradients and --check-stability, for all apps.
//
// Gradients: the library's check_gradients, with one row per input. Stability: for each extreme case, the primal and
// the gradient in float32 against double, and the step at which an optimizer diverges with and without safeguards.
#pragma once

#include <retrograde/retrograde.h>

#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/minimize.h"
#include "common/report.h"

namespace apps {

struct GradientRow {
  std::string input;
  double in_double = 0;     // adjoint against complex step or, if that is not possible, differences
  double in_float = 0;      // adjoint in float32 against double
  std::string method = {};  // the method that `in_double` compares with
};

// Limits that every app must keep.
inline constexpr double gradient_limit_double = 1e-6, gradient_limit_float = 1e-3;

std::vector<GradientRow> gradient_rows(const retrograde::GradientReport& report);
// Input, both errors and the limits.
Table gradient_table(const std::vector<GradientRow>& rows);
// Throws retrograde::UserError if an error is larger than its limit, or NaN.
void require_gradients(const std::vector<GradientRow>& rows);

// max |a - b| / max(max |b|, least). It is 0 if both are all zeros, and NaN if a value is not finite in `own` but
// finite in `exact`. Elements that are not finite in both do not count. `least`: smaller values count as zero, for
// example gradients that consist of rounding errors.
double relative_error(std::span<const double> own, std::span<const double> exact, double least = 0);

// The derivative of `loss` at a point along a direction: central differences with `step` and half of it, extrapolated
// (Richardson), so that the remaining error is of fourth order.
double difference_along(const std::function<double(const std::vector<double>&)>& loss,
                        const std::vector<double>& at, const std::vector<double>& direction,
                        double step);

struct StabilityRow {
  std::string name;
  double primal_error = 0, gradient_error = 0;                     // float32 against double, worst
  std::optional<long> diverges_plain = {}, diverges_guarded = {};  // nothing if it does not diverge
  long steps = 0;                                                  // that were tried
};
Table stability_table(const std::vector<StabilityRow>& rows);

// The first step whose loss is not finite, or exceeds `factor` times the first loss and never falls below that again;
// nothing if there is none.
std::optional<long> diverging_step(std::span<const LossSample> series, double factor = 10);

// Adam at a rate far above the one that the app uses. A loss of `explosion` times the lowest one counts as diverged.
MinimizeOptions large_steps(long steps, double rate, double explosion = INFINITY);

// Runs the optimizer twice from `start`, without and with safeguards, and records the steps at which it diverges.
void measure_divergence(StabilityRow& row, const Problem& problem, std::span<const double> start,
                        MinimizeOptions options);

}  // namespace apps

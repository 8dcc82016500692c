// checks.h -- what --check-gradients and --check-stability of all apps measure and show.
//
// Gradients: the library's check_gradients, a line for each input. Stability: for each extreme case, the
// primal and the gradient in float32 against double, and the step at which an optimizer diverges with and
// without safeguards.
#pragma once

#include <retrograde/retrograde.h>

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
  double in_double = 0;     // adjoint against complex step; without one, against differences
  double in_float = 0;      // adjoint in float32 against double
  std::string method = {};  // what `in_double` compares with
};

// What every app must keep.
inline constexpr double gradient_limit_double = 1e-6, gradient_limit_float = 1e-3;

std::vector<GradientRow> gradient_rows(const retrograde::GradientReport& report);
// Input, both errors and the limits.
Table gradient_table(const std::vector<GradientRow>& rows);
// Throws retrograde::UserError when an error is larger than its limit, or no number.
void require_gradients(const std::vector<GradientRow>& rows);

// max |a - b| / max(max |b|, least): 0 where both are all zeros, NaN where a value is not finite in `own`
// but in `exact`. Elements that are not finite in both alike do not count. `least`: what is smaller is
// nothing, as a gradient is of which rounding alone is left.
double relative_error(std::span<const double> own, std::span<const double> exact, double least = 0);

struct StabilityRow {
  std::string name;
  double primal_error = 0, gradient_error = 0;                     // float32 against double, worst
  std::optional<long> diverges_plain = {}, diverges_guarded = {};  // nothing: it does not
  long steps = 0;                                                  // that were tried
};
Table stability_table(const std::vector<StabilityRow>& rows);

// The first step whose loss is not finite, or over `factor` times the first loss and never below that
// again; nothing: none.
std::optional<long> diverging_step(std::span<const LossSample> series, double factor = 10);

// Runs the optimizer twice from `start`, without and with safeguards, and enters the steps.
void measure_divergence(StabilityRow& row, const Problem& problem, std::span<const double> start,
                        MinimizeOptions options);

}  // namespace apps

// checks.cpp -- see checks.h.
#include "common/checks.h"

#include <algorithm>
#include <cmath>

#include "diagnostics/error.h"

namespace apps {

using retrograde::quoted;
using retrograde::text;

namespace {

nlohmann::json cell(double value) {
  if (std::isnan(value)) return "NaN";
  return value;
}

nlohmann::json step_cell(const std::optional<long>& step) {
  return step ? nlohmann::json(*step) : nlohmann::json("never");
}

// Not std::max: a NaN must win and stay.
double worse(double a, double b) { return std::isnan(a) || a > b ? a : b; }

}  // namespace

std::vector<GradientRow> gradient_rows(const retrograde::GradientReport& report) {
  std::vector<GradientRow> rows;
  const bool complex_step = report.complex_step_refused.empty();
  for (const auto& input : report.inputs) {
    const double against = complex_step ? input.complex_step_error : input.adjoint_error;
    rows.push_back({input.name, worse(against, input.dot_product_error), input.own_precision_error,
                    complex_step ? "complex step, tangent" : "differences, tangent"});
  }
  return rows;
}

Table gradient_table(const std::vector<GradientRow>& rows) {
  Table table{"gradients", {"by", "in double against", "error", "float32 against double"}, {}};
  for (const GradientRow& row : rows)
    table.rows.push_back({row.input, row.method, cell(row.in_double), cell(row.in_float)});
  return table;
}

void require_gradients(const std::vector<GradientRow>& rows) {
  for (const GradientRow& row : rows) {
    if (row.in_double <= gradient_limit_double && row.in_float <= gradient_limit_float) continue;
    retrograde::call_error(
        text("trust the gradient by ", quoted(row.input)),
        text("it must be right to ", gradient_limit_double, " in double and to ",
             gradient_limit_float, " in float32"),
        text("its errors are ", row.in_double, " and ", row.in_float),
        "Check at another point: differences see the kinks of a model; anything else is a bug");
  }
}

double relative_error(std::span<const double> own, std::span<const double> exact, double least) {
  RETROGRADE_ASSERT(own.size() == exact.size(), "comparing ", own.size(), " with ", exact.size());
  double worst = 0, largest = least;
  for (size_t n = 0; n < own.size(); ++n) {
    if (!std::isfinite(exact[n])) continue;
    largest = std::max(largest, std::abs(exact[n]));
    worst = worse(std::abs(own[n] - exact[n]), worst);
  }
  if (!std::isfinite(worst)) return NAN;
  return worst == 0 ? 0 : worst / largest;
}

double difference_along(const std::function<double(const std::vector<double>&)>& loss,
                        const std::vector<double>& at, const std::vector<double>& direction,
                        double step) {
  const auto loss_at = [&](double move) {
    std::vector<double> moved = at;
    for (size_t n = 0; n < at.size(); ++n) moved[n] += move * direction[n];
    return loss(moved);
  };
  const auto central = [&](double h) { return (loss_at(h) - loss_at(-h)) / (2 * h); };
  return (4 * central(step / 2) - central(step)) / 3;
}

Table stability_table(const std::vector<StabilityRow>& rows) {
  Table table{"stability",
              {"case", "primal, float32 against double", "gradient, float32 against double",
               "diverges at step without safeguards", "with"},
              {}};
  for (const StabilityRow& row : rows) {
    table.rows.push_back({row.name, cell(row.primal_error), cell(row.gradient_error),
                          step_cell(row.diverges_plain), step_cell(row.diverges_guarded)});
  }
  return table;
}

std::optional<long> diverging_step(std::span<const LossSample> series, double factor) {
  if (series.empty()) return {};
  const double limit = factor * std::abs(series.front().loss);
  std::optional<long> first;
  for (const LossSample& sample : series) {
    const bool bad = !std::isfinite(sample.loss) || sample.loss > limit;
    if (!bad) first.reset();
    if (bad && !first) first = sample.step;
  }
  return first;
}

MinimizeOptions large_steps(long steps, double rate, double explosion) {
  MinimizeOptions options{.method = Method::Adam, .steps = steps, .rate = rate};
  options.adam.explosion = explosion;
  return options;
}

void measure_divergence(StabilityRow& row, const Problem& problem, std::span<const double> start,
                        MinimizeOptions options) {
  row.steps = options.steps;
  options.safeguard = false;
  row.diverges_plain = diverging_step(minimize(problem, start, options).series);
  options.safeguard = true;
  // Refused steps are undone, so only the points that the run kept count.
  std::vector<LossSample> kept;
  double lowest = INFINITY;
  for (const LossSample& sample : minimize(problem, start, options).series) {
    const bool refused =
        !std::isfinite(sample.loss) || sample.loss > options.adam.explosion * lowest;
    if (!refused) kept.push_back(sample);
    lowest = std::fmin(lowest, sample.loss);
  }
  row.diverges_guarded = diverging_step(kept);
}

}  // namespace apps

// minimize.cpp -- see minimize.h: the run that all optimizers share, and Adam's.
#include "common/minimize.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/minimize_run.h"
#include "common/stop.h"
#include "diagnostics/error.h"

namespace apps {

using retrograde::quoted;
using retrograde::text;

namespace {

constexpr std::pair<Method, const char*> method_names[] = {
    {Method::Adam, "adam"},
    {Method::Lbfgs, "lbfgs"},
    {Method::ConjugateGradient, "conjugate_gradient"},
    {Method::NewtonCg, "newton_cg"}};

double largest_magnitude(std::span<const double> values) {
  double largest = 0;
  for (const double v : values) largest = std::max(largest, std::abs(v));
  return largest;
}

}  // namespace

std::string name_of(Method method) {
  for (const auto& [one, name] : method_names) {
    if (one == method) return name;
  }
  retrograde::internal_error("a method without a name");
}

Method method_named(const std::string& name) {
  std::string all;
  for (const auto& [method, its_name] : method_names) {
    if (its_name == name) return method;
    all += (all.empty() ? "" : ", ") + std::string(its_name);
  }
  retrograde::call_error(text("optimize by ", quoted(name)), text("a method is one of ", all),
                         "this is not one of them", "Give one of these names");
}

bool all_finite(double number, std::span<const double> numbers) {
  return std::isfinite(number) &&
         std::all_of(numbers.begin(), numbers.end(), [](double v) { return std::isfinite(v); });
}

MinimizeRun::MinimizeRun(const Problem& problem, std::span<const double> start,
                         const MinimizeOptions& options, const StepCallback& callback)
    : problem_(problem),
      options_(options),
      callback_(callback),
      start_(std::chrono::steady_clock::now()) {
  std::vector<double> gradient(problem.size);
  found_.x.assign(start.begin(), start.end());
  found_.loss = problem.evaluate(start, gradient);
  ++found_.evaluations;
  if (!all_finite(found_.loss, gradient)) {
    retrograde::call_error(
        "optimize from this start", "the loss and its gradient must be finite there",
        text("the loss is ", found_.loss, std::isfinite(found_.loss) ? ", its gradient not" : ""),
        "Give another input, or parameters nearer to what it is made for");
  }
  found_.series.push_back({0, seconds(), found_.loss});
}

double MinimizeRun::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

double MinimizeRun::evaluate(std::span<const double> x, std::span<double> gradient) {
  const double loss = problem_.evaluate(x, gradient);
  ++found_.evaluations;
  if (all_finite(loss, gradient)) {
    keep_best(loss, x);
  } else {
    ++found_.refused;
  }
  return loss;
}

std::vector<double> MinimizeRun::product(std::span<const double> x, std::span<const double> v) {
  std::vector<double> out(problem_.size);
  problem_.hessian_product(x, v, out);
  ++found_.products;
  return out;
}

void MinimizeRun::keep_best(double loss, std::span<const double> x) {
  if (!(loss < found_.loss)) return;
  found_.loss = loss;
  found_.x.assign(x.begin(), x.end());
}

std::string MinimizeRun::reason_to_end(double loss, std::span<const double> gradient) {
  if (stop_requested()) return "it was stopped";
  if (found_.steps >= options_.steps) return "all steps are done";
  if (options_.seconds > 0 && seconds() >= options_.seconds) return "its time is over";
  if (!gradient.empty() && largest_magnitude(gradient) <= options_.gradient_tolerance)
    return "the gradient is small";
  const double before = found_.series[found_.series.size() - 2].loss;
  if (options_.loss_tolerance > 0 &&
      std::abs(before - loss) <= options_.loss_tolerance * std::abs(before))
    return "the loss hardly changes";
  return {};
}

bool MinimizeRun::ends_after_step(double loss, std::span<const double> gradient) {
  ++found_.steps;
  found_.series.push_back({found_.steps, seconds(), loss});
  const bool goes_on = !callback_ || callback_(found_.series.back(), found_.x);
  found_.ended = goes_on ? reason_to_end(loss, gradient) : "the program ended it";
  return ended();
}

Minimum MinimizeRun::take() {
  found_.seconds = seconds();
  found_.stopped = stop_requested();
  return std::move(found_);
}

void run_adam(MinimizeRun& run, std::vector<double> x) {
  const MinimizeOptions& options = run.options();
  std::optional<Adam> own;
  if (!options.moments) {
    AdamOptions with = options.adam;
    with.safeguard = options.safeguard;
    own.emplace(std::vector<AdamGroup>{{x.size(), options.rate}}, with);
  }
  Adam& adam = options.moments ? *options.moments : *own;
  std::vector<double> gradient(x.size());
  double loss = run.problem().evaluate(x, gradient);
  do {
    adam.step(x, loss, gradient);
    loss = run.evaluate(x, gradient);
  } while (!run.ends_after_step(loss, {}));
}

Minimum minimize(const Problem& problem, std::span<const double> start,
                 const MinimizeOptions& options, const StepCallback& callback) {
  RETROGRADE_ASSERT(start.size() == problem.size, "a start of ", start.size(), " numbers for ",
                    problem.size);
  MinimizeRun run(problem, start, options, callback);
  std::vector<double> x(start.begin(), start.end());
  switch (options.method) {
    case Method::Adam:
      run_adam(run, std::move(x));
      break;
    case Method::NewtonCg:
      run_newton_cg(run, std::move(x));
      break;
    default:
      run_ceres(run, std::move(x));
  }
  return run.take();
}

}  // namespace apps

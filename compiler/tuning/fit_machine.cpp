#include "tuning/fit_machine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace retrograde::tuning {

namespace {

constexpr double largest_log = 1.3862943611198906;  // of a factor: of 4
constexpr double pull = 0.02;        // of each factor to 1, against one sample's share
constexpr double difference = 0.02;  // for derivatives
constexpr int most_steps = 12;

struct Term {
  const char* name;
  std::vector<double planning::Machine::*> figures;
  size_t level;  // of a cache whose bandwidths it is; 0: none
};
const std::vector<Term>& terms() {
  using M = planning::Machine;
  static const std::vector<Term> all = {
      {"arithmetic",
       {&M::operation_ns, &M::divide_ns, &M::divide_double_ns, &M::sqrt_ns, &M::sqrt_double_ns,
        &M::exp_ns, &M::log_ns, &M::pow_ns, &M::sin_ns, &M::shuffle_ns},
       0},
      {"loops", {&M::scalar_ns, &M::scalar_divide_ns, &M::iteration_ns}, 0},
      {"loads", {&M::load_ns, &M::gather_lane_ns}, 0},
      {"stores", {&M::store_ns, &M::scatter_lane_ns}, 0},
      {"waiting", {&M::latency_ns, &M::memory_latency_ns}, 0},
      {"L2", {}, 1},
      {"L3", {}, 2},
      {"memory", {}, 3},
      {"launch", {&M::launch_ns}, 0},
  };
  return all;
}

using Vector = std::vector<double>;

planning::Machine with_factors(const planning::Machine& start, const Vector& logs) {
  planning::Machine machine = start;
  for (size_t i = 0; i < logs.size(); i++) {
    const Term& term = terms()[i];
    const double factor = std::exp(logs[i]);
    for (double planning::Machine::*figure : term.figures) machine.*figure *= factor;
    if (term.level == 0) continue;
    machine.levels[term.level].one_thread /= factor;
    machine.levels[term.level].all_threads /= factor;
  }
  return machine;
}

// log(predicted / measured), then what pulls each factor to 1.
Vector residuals(const planning::Machine& start, const Vector& logs,
                 const std::vector<FitSample>& samples) {
  const planning::Machine machine = with_factors(start, logs);
  Vector result;
  for (const FitSample& sample : samples)
    result.push_back(std::log(sample.predict(machine) / sample.measured_seconds));
  const double weight = std::sqrt(pull * static_cast<double>(samples.size()));
  for (const double log : logs) result.push_back(weight * log);
  return result;
}

double squares(const Vector& v) {
  double sum = 0;
  for (const double x : v) sum += x * x;
  return sum;
}

// a x = b, a symmetric and positive definite: elimination needs no pivots.
Vector solve(std::vector<Vector> a, Vector b) {
  const size_t n = b.size();
  for (size_t i = 0; i < n; i++) {
    for (size_t j = i + 1; j < n; j++) {
      const double factor = a[j][i] / a[i][i];
      for (size_t k = i; k < n; k++) a[j][k] -= factor * a[i][k];
      b[j] -= factor * b[i];
    }
  }
  for (size_t i = n; i-- > 0;) {
    for (size_t k = i + 1; k < n; k++) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  return b;
}

// Where a step from here leads; the more damping, the shorter.
Vector stepped(const Vector& from, const std::vector<Vector>& columns, const Vector& at,
               double damping) {
  const size_t n = from.size();
  std::vector<Vector> a(n, Vector(n));
  Vector b(n);
  for (size_t i = 0; i < n; i++) {
    for (size_t j = 0; j < n; j++) {
      for (size_t k = 0; k < at.size(); k++) a[i][j] += columns[i][k] * columns[j][k];
    }
    for (size_t k = 0; k < at.size(); k++) b[i] -= columns[i][k] * at[k];
    a[i][i] *= 1 + damping;
  }
  Vector result = solve(std::move(a), std::move(b));
  for (size_t i = 0; i < n; i++)
    result[i] = std::clamp(from[i] + result[i], -largest_log, largest_log);
  return result;
}

}  // namespace

double fit_error(const planning::Machine& machine, const std::vector<FitSample>& samples) {
  double sum = 0;
  for (const FitSample& sample : samples) {
    const double log = std::log(sample.predict(machine) / sample.measured_seconds);
    sum += log * log;
  }
  return samples.empty() ? 1 : std::exp(std::sqrt(sum / static_cast<double>(samples.size())));
}

MachineFit fit_machine(const planning::Machine& start, const std::vector<FitSample>& samples) {
  MachineFit fit{start, {}, fit_error(start, samples), 0};
  Vector logs(terms().size());
  double damping = 0.01;
  Vector at = residuals(start, logs, samples);
  for (int step = 0; step < most_steps && !samples.empty() && damping < 100; step++) {
    std::vector<Vector> columns;
    for (size_t i = 0; i < logs.size(); i++) {
      Vector moved = logs;
      moved[i] += difference;
      columns.push_back(residuals(start, moved, samples));
      for (size_t k = 0; k < at.size(); k++) columns[i][k] = (columns[i][k] - at[k]) / difference;
    }
    for (; damping < 100; damping *= 8) {
      const Vector tried = stepped(logs, columns, at, damping);
      Vector there = residuals(start, tried, samples);
      if (squares(there) >= squares(at) * (1 - 1e-6)) continue;
      logs = tried;
      at = std::move(there);
      damping = std::max(damping / 16, 1e-4);
      break;
    }
  }
  fit.machine = with_factors(start, logs);
  for (size_t i = 0; i < logs.size(); i++)
    fit.terms.push_back({terms()[i].name, std::exp(logs[i])});
  fit.error_after = fit_error(fit.machine, samples);
  return fit;
}

}  // namespace retrograde::tuning

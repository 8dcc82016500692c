#include "stability/measure.h"

#include <cmath>
#include <limits>
#include <sstream>

#include "autodiff/derivative.h"

namespace retrograde::stability {

namespace {

using Limits = std::numeric_limits<float>;

Buffer<float> realized_adjoint(const Problem& problem, const Buffer<float>& inputs, int count) {
  Func f = problem.build(inputs);
  Buffer<float> ones(count);
  ones.fill(1);
  Derivative d = propagate_adjoints(f, ones, {.overwritten = Overwritten::Store});
  Buffer<float> result(problem.n, count);
  d(inputs).realize(result);
  return result;
}

Tape::Gradient true_gradient(const Problem& problem, const std::vector<float>& numbers) {
  Tape tape;
  std::vector<Traced> x;
  for (float v : numbers) x.push_back(tape.input(v));
  Tape::Gradient result = tape.differentiate(problem.value(x), numbers.size());
  if (problem.gradient) result.adjoints = problem.gradient(Reals(numbers.begin(), numbers.end()));
  return result;
}

std::string text_of(const std::vector<float>& numbers, const std::vector<float>& found,
                    const Reals& expected) {
  std::ostringstream out;
  auto list = [&](const auto& values) {
    out << "(";
    for (size_t k = 0; k < values.size(); ++k) out << (k ? ", " : "") << values[k];
    out << ")";
  };
  list(numbers);
  out << ": ";
  list(found);
  out << " instead of ";
  list(expected);
  return out.str();
}

void compare(Cell& cell, const std::vector<float>& numbers, const std::vector<float>& found,
             const Reals& expected) {
  Real scale = Limits::min(), worst = 0;
  bool lost = false;
  for (size_t i = 0; i < found.size(); ++i) {
    if (!(std::abs(expected[i]) <= Limits::max())) return;
    lost |= !std::isfinite(found[i]);
    scale = std::max(scale, std::abs(expected[i]));
    worst = std::max(worst, std::abs(found[i] - expected[i]));
  }
  ++cell.cases;
  if (lost) {
    if (cell.lost++ == 0) cell.lost_at = text_of(numbers, found, expected);
    return;
  }
  const double error = static_cast<double>(worst / scale);
  if (error <= cell.worst_error) return;
  cell.worst_error = error;
  cell.worst_at = text_of(numbers, found, expected);
}

}  // namespace

Row measure(const Problem& problem) {
  const auto all = cases(problem.n);
  const int count = static_cast<int>(all.size());
  Buffer<float> inputs(problem.n, count);
  for (int c = 0; c < count; ++c) {
    for (int i = 0; i < problem.n; ++i)
      inputs(i, c) = all[static_cast<size_t>(c)][static_cast<size_t>(i)];
  }
  Buffer<float> found = realized_adjoint(problem, inputs, count);
  Row row;
  for (int c = 0; c < count; ++c) {
    const auto& numbers = all[static_cast<size_t>(c)];
    std::vector<float> gradient;
    for (int i = 0; i < problem.n; ++i) gradient.push_back(found(i, c));
    const Tape::Gradient expected = true_gradient(problem, numbers);
    Cell& cell = expected.has_left ? row.left : row.cells[static_cast<size_t>(extreme_of(numbers))];
    compare(cell, numbers, gradient, expected.adjoints);
  }
  return row;
}

}  // namespace retrograde::stability

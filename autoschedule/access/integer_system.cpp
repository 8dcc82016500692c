#include "autoschedule/access/integer_system.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "ir/expr.h"

namespace retrograde::planning {

namespace {

using ir::ConstantRange;
using Wide = __int128;

Wide rounded_down(Wide a, Wide b) {  // b > 0
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

int64_t narrowed(Wide value) {
  return static_cast<int64_t>(std::clamp<Wide>(value, INT64_MIN, INT64_MAX));
}

// A sum of ranges, in which unbounded ends are counted.
struct WideRange {
  Wide min = 0, max = 0;
  int without_min = 0, without_max = 0;

  void add(const ConstantRange& range, int64_t factor, int times = 1) {
    const Wide low = Wide{range.min} * factor * times, high = Wide{range.max} * factor * times;
    const bool has_min = range.has_lower_bound(), has_max = range.has_upper_bound();
    (factor > 0 ? min : max) += has_min ? low : 0;
    (factor > 0 ? max : min) += has_max ? high : 0;
    (factor > 0 ? without_min : without_max) += has_min ? 0 : times;
    (factor > 0 ? without_max : without_min) += has_max ? 0 : times;
  }
  // The numbers that give 0 with this sum after multiplication by `factor`.
  ConstantRange opposite(int64_t factor) const {
    ConstantRange result;
    const Wide size = std::abs(factor);
    if (without_max == 0) result.min = narrowed(-rounded_down(max, size));
    if (without_min == 0) result.max = narrowed(rounded_down(-min, size));
    if (factor > 0) return result;
    return {result.max == INT64_MAX ? INT64_MIN : -result.max,
            result.min == INT64_MIN ? INT64_MAX : -result.min};
  }
};

struct Row {
  std::vector<int64_t> coefficients;  // by variable
  ConstantRange constant;

  // Subtracts a multiple of an equation so that this variable cancels. False: a number is too large.
  bool cancel(size_t variable, const Row& equation) {
    const int64_t common = std::gcd(coefficients[variable], equation.coefficients[variable]);
    int64_t own = equation.coefficients[variable] / common, other = coefficients[variable] / common;
    if (own < 0) {  // conditions keep their direction
      own = -own;
      other = -other;
    }
    const auto combine = [&](int64_t& value, int64_t subtracted) {
      const Wide combined = Wide{value} * own - Wide{subtracted} * other;
      value = static_cast<int64_t>(combined);
      return combined < INT64_MAX && combined > -INT64_MAX;
    };
    bool fits = true;
    for (size_t v = 0; v < coefficients.size(); ++v)
      fits = combine(coefficients[v], equation.coefficients[v]) && fits;
    if (constant.has_lower_bound()) fits = combine(constant.min, equation.constant.min) && fits;
    if (constant.has_upper_bound()) fits = combine(constant.max, equation.constant.min) && fits;
    return fits;
  }
};

}  // namespace

int IntegerSystem::add_variable(const ConstantRange& range) {
  ranges_.push_back(range);
  return static_cast<int>(ranges_.size()) - 1;
}

void IntegerSystem::add_condition(const std::vector<Term>& sum, const ConstantRange& constant) {
  conditions_.push_back({sum, constant});
}

void IntegerSystem::restrict(int variable, const ConstantRange& range) {
  ConstantRange& known = ranges_[static_cast<size_t>(variable)];
  known = intersection(known, range);
}

void IntegerSystem::combine_equations(int kept) {
  std::vector<Row> rows;
  for (const Condition& condition : conditions_) {
    Row& row = rows.emplace_back(std::vector<int64_t>(ranges_.size()), condition.constant);
    for (const Term& term : condition.sum)
      row.coefficients[static_cast<size_t>(term.variable)] = term.coefficient;
  }
  // The smallest coefficients cancel first: those of size 1 keep the remainders of the others.
  std::vector<bool> is_done = ir::mapped(rows, [](const Row& r) { return !r.constant.is_point(); });
  while (true) {
    const Row* equation = nullptr;
    size_t variable = 0;
    int64_t best = INT64_MAX;
    for (size_t r = 0; r < rows.size(); ++r) {
      for (size_t v = ranges_.size(); v-- > 0 && !is_done[r];) {
        int64_t size = std::abs(rows[r].coefficients[v]);
        if (size != 0 && v < static_cast<size_t>(kept)) size += INT64_MAX / 2;
        if (size == 0 || size >= best) continue;
        best = size;
        equation = &rows[r];
        variable = v;
      }
    }
    if (!equation) break;
    is_done[static_cast<size_t>(equation - rows.data())] = true;
    for (Row& row : rows) {
      const bool cancels = &row != equation && row.coefficients[variable] != 0;
      if (cancels && !row.cancel(variable, *equation)) return;
    }
  }
  for (const Row& row : rows) {
    Condition& condition = conditions_.emplace_back();
    condition.constant = row.constant;
    for (size_t v = 0; v < row.coefficients.size(); ++v) {
      if (row.coefficients[v] != 0)
        condition.sum.push_back({static_cast<int>(v), row.coefficients[v]});
    }
  }
}

bool IntegerSystem::narrow() {
  constexpr int most_rounds = 30;  // a sum may narrow its variables by 1 each time
  bool has_changed = true;
  for (int round = 0; has_changed && round < most_rounds; ++round) {
    has_changed = false;
    for (const Condition& condition : conditions_) {
      if (!narrow(condition, has_changed)) return false;
    }
  }
  return true;
}

bool IntegerSystem::narrow(const Condition& condition, bool& has_changed) {
  WideRange all;
  all.add(condition.constant, 1);
  for (const Term& term : condition.sum) all.add(range(term.variable), term.coefficient);
  for (const Term& term : condition.sum) {
    ConstantRange& known = ranges_[static_cast<size_t>(term.variable)];
    WideRange others = all;
    others.add(known, term.coefficient, -1);
    const ConstantRange now = intersection(known, others.opposite(term.coefficient));
    if (now.min > now.max) return false;
    if (now == known) continue;
    all = others;
    all.add(now, term.coefficient);
    known = now;
    has_changed = true;
  }
  return has_fitting_remainder(condition);
}

// Variables with one value are constants; what the others give is a multiple of their common divisor.
bool IntegerSystem::has_fitting_remainder(const Condition& condition) const {
  WideRange constant;
  constant.add(condition.constant, 1);
  int64_t divisor = 0;
  for (const Term& term : condition.sum) {
    if (range(term.variable).is_point())
      constant.add(range(term.variable), term.coefficient);
    else
      divisor = std::gcd(divisor, term.coefficient);
  }
  if (constant.without_min > 0 || constant.without_max > 0) return true;
  if (divisor == 0) return constant.min <= 0 && constant.max >= 0;
  return rounded_down(constant.max, divisor) * divisor >= constant.min;
}

}  // namespace retrograde::planning

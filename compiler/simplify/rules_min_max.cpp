// Minimum and maximum: operands that are never chosen go, common terms move out.
#include <algorithm>

#include "ir/build.h"
#include "ir/equal.h"
#include "simplify/simplifier.h"

namespace retrograde::simplification {

namespace {

// Beyond this many terms nothing is expected to decide a difference.
constexpr size_t max_compared_terms = 8;

Expr nest(Kind kind, std::vector<Expr> operands) {
  std::ranges::stable_sort(operands, [](const Expr& a, const Expr& b) {
    if (is_const(a) != is_const(b)) return is_const(b);  // the constant last
    return canonical_less(a, b);
  });
  Expr result = operands[0];
  for (size_t i = 1; i < operands.size(); ++i) result = binary(kind, result, operands[i]);
  return result;
}

// What all operands have in common; removed from them.
Sum take_common(std::vector<Sum>& sums) {
  Sum common = constant_sum(sums[0].type, 0);
  for (const Term& term : sums[0].terms) {
    const auto has_it = [&](const Sum& s) {
      const Term* found = s.find(term.atom);
      return found && found->factor == term.factor;
    };
    if (std::ranges::all_of(sums, has_it)) common.add(term.atom, term.factor);
  }
  const auto same_constant = [&](const Sum& s) { return s.constant == sums[0].constant; };
  if (std::ranges::all_of(sums, same_constant)) common.add_constant(sums[0].constant);
  for (Sum& sum : sums) sum.add(common, -1);
  return common;
}

}  // namespace

Expr Simplifier::min_max(Kind kind, const Expr& a, const Expr& b) {
  if (equal(a, b)) return a;
  if (!a.type().is_int_or_uint()) return binary(kind, a, b);
  const ConstantRange ra = facts_.range(a), rb = facts_.range(b);
  const bool is_min = kind == Kind::Min;
  if (ra.max <= rb.min && ra.max != INT64_MAX) return is_min ? a : b;
  if (rb.max <= ra.min && rb.max != INT64_MAX) return is_min ? b : a;

  std::vector<Expr> operands = operands_of(kind, a);
  const std::vector<Expr> others = operands_of(kind, b);
  // Whether x is never chosen over y: always at least (min) or at most (max) y.
  const auto dominated = [&](const Expr& x, const Expr& y) {
    if (equal(x, y)) return true;
    const std::optional<int64_t> cx = as_const_int(x), cy = as_const_int(y);
    if (cx && cy) return is_min ? *cx >= *cy : *cx <= *cy;
    if (!is_index_type(x.type()) || x.type().is_vector()) return false;
    Sum difference = plus(sum_of(x), sum_of(y), -1);
    while (cancel_names(difference)) {
    }
    if (difference.terms.size() > max_compared_terms) return false;
    return is_min ? facts_.lower_bound(difference) >= 0 : facts_.upper_bound(difference) <= 0;
  };
  for (const Expr& other : others) {
    const auto hidden = [&](const Expr& x) { return dominated(other, x); };
    if (std::ranges::any_of(operands, hidden)) continue;
    std::erase_if(operands, [&](const Expr& x) { return dominated(x, other); });
    operands.push_back(other);
  }
  if (operands.size() == 1) return operands[0];
  if (!is_index_type(a.type()) || a.type().is_vector()) return nest(kind, operands);
  auto sums = mapped(operands, [&](const Expr& operand) { return sum_of(operand); });
  const Sum common = take_common(sums);
  const bool valid =
      common.valid && std::ranges::all_of(sums, [](const Sum& s) { return s.valid; });
  if (!valid || (common.is_constant() && common.constant == 0)) return nest(kind, operands);
  for (size_t i = 0; i < operands.size(); ++i) operands[i] = rebuild(sums[i]);
  return apply(Kind::Add, nest(kind, operands), rebuild(common));
}

}  // namespace retrograde::simplification

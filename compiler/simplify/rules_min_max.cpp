// Minimum and maximum: drops operands that are never selected, and moves common terms out.
#include <algorithm>

#include "ir/build.h"
#include "ir/equal.h"
#include "simplify/simplifier.h"

namespace retrograde::simplification {

namespace {

// Differences with more terms than this are unlikely to be decided and are not tried.
constexpr size_t max_compared_terms = 8;
// Nests with more operands than this are not inspected.
constexpr size_t most_leaves = 9;

Expr nest(Kind kind, std::vector<Expr> operands) {
  std::ranges::stable_sort(operands, [](const Expr& a, const Expr& b) {
    if (is_const(a) != is_const(b)) return is_const(b);  // the constant comes last
    return canonical_less(a, b);
  });
  Expr result = operands[0];
  for (size_t i = 1; i < operands.size(); ++i) result = binary(kind, result, operands[i]);
  return result;
}

// Removes the terms that all operands have in common, and returns them.
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

bool is_shifted(const Sum& sum, Kind kind) {
  return sum.terms.size() == 1 && sum.terms[0].factor == 1 && sum.terms[0].atom.kind() == kind;
}

// Counts the operands of nested minima and maxima, up to `most`.
size_t leaves(const Expr& e, size_t most) {
  const Sum sum = sum_of(e);
  if (most <= 1 || (!is_shifted(sum, Kind::Min) && !is_shifted(sum, Kind::Max))) return 1;
  const auto* n = sum.terms[0].atom.as<Binary>();
  const size_t left = leaves(n->a, most - 1);
  return left >= most ? most : left + leaves(n->b, most - left);
}

}  // namespace

// max(min(max(x, 0), 9) - 1, 0) => min(max(x - 1, 0), 8): merges nested clamps when fewer operands
// remain. Undefined when nothing is gained.
Expr Simplifier::distribute_min_max(Kind kind, const std::vector<Expr>& operands) {
  const Kind other = kind == Kind::Min ? Kind::Max : Kind::Min;
  size_t before = 0;
  for (const Expr& operand : operands) before += leaves(operand, most_leaves);
  if (before >= most_leaves) return {};
  for (size_t i = 0; i < operands.size(); ++i) {
    if (!is_shifted(sum_of(operands[i]), other) || may_be_extreme(operands[i], 3)) continue;
    std::vector<Expr> parts;
    for (const Expr& inner : shifted_operands(other, operands[i])) {
      std::vector<Expr> chosen = shifted_operands(kind, inner);
      for (size_t j = 0; j < operands.size(); ++j) {
        if (j != i) add_operand(kind, operands[j], chosen);
      }
      add_operand(other, nest(kind, std::move(chosen)), parts);
    }
    Expr result = nest(other, std::move(parts));
    if (leaves(result, most_leaves) < before) return result;
  }
  return {};
}

// Whether x is never selected over y: always at least y (min) or at most y (max).
bool Simplifier::is_dominated(Kind kind, const Expr& x, const Expr& y) {
  if (equal(x, y)) return true;
  const bool is_min = kind == Kind::Min;
  const std::optional<int64_t> cx = as_const_int(x), cy = as_const_int(y);
  if (cx && cy) return is_min ? *cx >= *cy : *cx <= *cy;
  if (!is_index_type(x.type()) || x.type().is_vector()) return false;
  Sum difference = plus(sum_of(x), sum_of(y), -1);
  while (cancel_names(difference)) {
  }
  if (difference.terms.size() > max_compared_terms) return false;
  return is_min ? facts_.lower_bound(difference) >= 0 : facts_.upper_bound(difference) <= 0;
}

void Simplifier::add_operand(Kind kind, const Expr& operand, std::vector<Expr>& operands) {
  const auto hides = [&](const Expr& x) { return is_dominated(kind, operand, x); };
  if (std::ranges::any_of(operands, hides)) return;
  std::erase_if(operands, [&](const Expr& x) { return is_dominated(kind, x, operand); });
  operands.push_back(operand);
}

// The operands of a nest, also of one that is shifted by a constant: max(max(x, 0) - 1, y) is max(x
// - 1, -1, y).
std::vector<Expr> Simplifier::shifted_operands(Kind kind, const Expr& e) {
  if (!is_index_type(e.type()) || e.type().is_vector()) return operands_of(kind, e);
  std::vector<Expr> result;
  for (const Expr& operand : operands_of(kind, e)) {
    const Sum sum = sum_of(operand);
    const bool is_nest = is_shifted(sum, kind) && sum.constant != 0 &&
                         !may_be_extreme(operand, 2) && leaves(operand, most_leaves) < most_leaves;
    if (!is_nest) {
      result.push_back(operand);
      continue;
    }
    for (const Expr& inner : operands_of(kind, sum.terms[0].atom)) {
      Sum shifted = sum_of(inner);
      shifted.add_constant(sum.constant);
      result.push_back(rebuild(shifted));
    }
  }
  return result;
}

Expr Simplifier::min_max(Kind kind, const Expr& a, const Expr& b) {
  if (equal(a, b)) return a;
  if (!a.type().is_int_or_uint()) return binary(kind, a, b);
  const ConstantRange ra = facts_.range(a), rb = facts_.range(b);
  const bool is_min = kind == Kind::Min;
  if (ra.max <= rb.min && ra.max != INT64_MAX) return is_min ? a : b;
  if (rb.max <= ra.min && rb.max != INT64_MAX) return is_min ? b : a;

  std::vector<Expr> operands = shifted_operands(kind, a);
  for (const Expr& other : shifted_operands(kind, b)) add_operand(kind, other, operands);
  if (operands.size() == 1) return operands[0];
  if (!is_index_type(a.type()) || a.type().is_vector()) return nest(kind, operands);
  if (Expr single = distribute_min_max(kind, operands); single.defined()) return single;
  auto sums = mapped(operands, [&](const Expr& operand) { return sum_of(operand); });
  const Sum common = take_common(sums);
  const bool valid =
      common.valid && std::ranges::all_of(sums, [](const Sum& s) { return s.valid; });
  if (!valid || (common.is_constant() && common.constant == 0)) return nest(kind, operands);
  for (size_t i = 0; i < operands.size(); ++i) operands[i] = rebuild(sums[i]);
  return apply(Kind::Add, nest(kind, operands), rebuild(common));
}

}  // namespace retrograde::simplification

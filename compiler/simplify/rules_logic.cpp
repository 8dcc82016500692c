// Conditions: conjunctions, disjunctions, negations and selects.

#include "ir/build.h"
#include "ir/equal.h"
#include "simplify/simplifier.h"

namespace retrograde::simplification {

namespace {

bool is_negation(const Expr& a, const Expr& b) {
  const auto* not_a = a.as<Not>();
  const auto* not_b = b.as<Not>();
  return (not_a && equal(not_a->a, b)) || (not_b && equal(not_b->a, a));
}

// The sum that is negative where the comparison holds.
std::optional<Sum> negative_sum(const Expr& e) {
  if (e.kind() != Kind::LT && e.kind() != Kind::LE) return std::nullopt;
  const auto* n = e.as<Binary>();
  if (!is_index_type(n->a.type()) || n->a.type().is_vector()) return std::nullopt;
  Sum sum = plus(sum_of(n->a), sum_of(n->b), -1);
  if (e.kind() == Kind::LE) sum.add_constant(-1);
  return sum.valid ? std::optional(sum) : std::nullopt;
}

}  // namespace

// Combines two operands of a conjunction or disjunction: returns the constant result, or tells
// which operand is implied.
Expr Simplifier::combine_conditions(Kind kind, const Expr& a, const Expr& b, bool& drop_a,
                                    bool& drop_b) {
  const bool is_and = kind == Kind::And;
  const Expr decided = is_and ? const_false(a.type().lanes()) : const_true(a.type().lanes());
  if (equal(a, b)) {
    drop_b = true;
    return {};
  }
  if (is_negation(a, b)) return decided;
  const std::optional<Sum> x = negative_sum(a), y = negative_sum(b);
  if (!x || !y || x->terms.size() != y->terms.size()) return {};
  const Sum difference = plus(*x, *y, -1);
  if (difference.valid && difference.is_constant()) {
    const bool a_implies_b = difference.constant >= 0;
    (a_implies_b == is_and ? drop_b : drop_a) = true;
    return {};
  }
  // x < 0 with x > d: no integer when d >= -1; x < 0 or x > d: every integer when d < 0.
  const Sum total = plus(*x, *y);
  if (!total.valid || !total.is_constant()) return {};
  const bool decides = is_and ? total.constant >= -1 : total.constant < 0;
  return decides ? decided : Expr();
}

Expr Simplifier::logical(Kind kind, const Expr& a, const Expr& b) {
  if (is_const(a) || is_const(b)) return binary(kind, a, b);
  std::vector<Expr> parts = operands_of(kind, a);
  const std::vector<Expr> others = operands_of(kind, b);
  bool changed = false;
  for (const Expr& other : others) {
    bool drop_other = false;
    std::vector<Expr> kept;
    for (const Expr& part : parts) {
      bool drop_part = false;
      if (!drop_other) {
        if (Expr decided = combine_conditions(kind, part, other, drop_part, drop_other);
            decided.defined())
          return decided;
      }
      if (!drop_part) kept.push_back(part);
      changed |= drop_part;
    }
    parts = std::move(kept);
    if (!drop_other) parts.push_back(other);
    changed |= drop_other;
  }
  if (!changed) return binary(kind, a, b);
  Expr result = parts[0];
  for (size_t i = 1; i < parts.size(); ++i) result = binary(kind, result, parts[i]);
  return result;
}

// For floats, !(a < b) also holds for NaNs, so it stays.
Expr Simplifier::negate(const Expr& a) {
  if (const auto* splat = a.as<Broadcast>(); splat && !is_const(a))
    return broadcast(negate(splat->value), splat->lanes);
  const Kind kind = a.kind();
  const auto* n = a.as<Binary>();
  if (kind == Kind::EQ) return binary(Kind::NE, n->a, n->b);
  if (kind == Kind::NE) return binary(Kind::EQ, n->a, n->b);
  if (n && n->a.type().is_int_or_uint()) {
    if (kind == Kind::LT) return less(Kind::LE, n->b, n->a);
    if (kind == Kind::LE) return less(Kind::LT, n->b, n->a);
  }
  return logical_not(a);
}

Expr Simplifier::select(const Expr& condition, const Expr& t, const Expr& f) {
  if (is_const(condition) || equal(t, f)) return make_select(condition, t, equal(t, f) ? t : f);
  if (const std::optional<bool> known = facts_.decided(condition)) return *known ? t : f;
  if (const auto* n = condition.as<Not>()) return select(n->a, f, t);
  if (condition.kind() == Kind::NE) {
    const auto* n = condition.as<Binary>();
    return select(binary(Kind::EQ, n->a, n->b), f, t);
  }
  if (const auto* splat = condition.as<Broadcast>(); splat && splat->value.type().is_scalar()) {
    return select(splat->value, t, f);
  }
  const auto* inner_t = t.as<Select>();
  if (inner_t && equal(inner_t->condition, condition))
    return select(condition, inner_t->when_true, f);
  const auto* inner_f = f.as<Select>();
  if (inner_f && equal(inner_f->condition, condition))
    return select(condition, t, inner_f->when_false);
  const bool same_lanes = condition.type().lanes() == t.type().lanes();
  if (t.type().is_bool() && same_lanes) {
    if (is_const_true(t)) return logical(Kind::Or, condition, f);
    if (is_const_false(f)) return logical(Kind::And, condition, t);
    if (is_const_false(t)) return logical(Kind::And, negate(condition), f);
    if (is_const_true(f)) return logical(Kind::Or, negate(condition), t);
  }
  const auto* n = condition.as<Binary>();
  const bool orders =
      condition.kind() == Kind::LT || (condition.kind() == Kind::LE && t.type().is_int_or_uint());
  if (orders && same_lanes && n->a.type() == t.type()) {  // a < b ? a : b is the definition of min
    if (equal(n->a, t) && equal(n->b, f)) return apply(Kind::Min, t, f);
    if (equal(n->b, t) && equal(n->a, f)) return apply(Kind::Max, t, f);
  }
  return make_select(condition, t, f);
}

}  // namespace retrograde::simplification

// Comparisons. On index types every comparison becomes sum < 0 or sum == 0 for one sum.
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/scalar.h"
#include "simplify/simplifier.h"

namespace retrograde::simplification {

namespace {

// Positive terms on the left, negative ones on the right: sum == left - right + constant.
struct Sides {
  Sum left, right;
};
Sides sides_of(const Sum& sum) {
  Sides sides{constant_sum(sum.type, 0), constant_sum(sum.type, 0)};
  for (const Term& term : sum.terms) {
    if (term.factor > 0) {
      sides.left.add(term.atom, term.factor);
    } else {
      sides.right.add(times(Sum{sum.type, {term}, 0, true}, -1), 1);
    }
  }
  return sides;
}

bool is_scalar_index(const Expr& e) { return is_index_type(e.type()) && e.type().is_scalar(); }

// Divides by the greatest common divisor of the factors; the constant rounds down.
void divide_by_common_factor(Sum& sum) {
  const int64_t g = common_factor(sum);
  if (g <= 1) return;
  for (Term& term : sum.terms) term.factor /= g;
  sum.constant = euclidean_div(sum.constant, g);
}

}  // namespace

Expr Simplifier::equals(const Expr& a, const Expr& b) {
  const int lanes = a.type().lanes();
  if (a.type().is_bool()) {
    if (is_const_true(b)) return a;
    if (is_const_true(a)) return b;
    if (is_const_false(b)) return negate(a);
    if (is_const_false(a)) return negate(b);
  }
  if (!has_sums(a.type())) return binary(Kind::EQ, a, b);
  const ConstantRange ra = facts_.range(a), rb = facts_.range(b);
  if (ra.max < rb.min || rb.max < ra.min) return const_false(lanes);
  Sum sum = plus(sum_of(a), sum_of(b), -1);
  if (!sum.valid) return binary(Kind::EQ, a, b);
  while (cancel_names(sum)) {
  }
  if (sum.is_constant()) return make_const(Bool(lanes), int64_t{sum.constant == 0});
  if (!is_scalar_index(a)) {
    if (const Expr both = compare_vectors(Kind::EQ, a, b); both.defined()) return both;
    return binary(Kind::EQ, a, b);
  }
  if (facts_.upper_bound(sum) < 0 || facts_.lower_bound(sum) > 0) return const_false();
  if (sum.terms.size() == 1) {  // select(c, 3, 4) == 3 => c
    const auto* choice = sum.terms[0].atom.as<Select>();
    const auto is_zero_with = [&](const Expr& arm) {
      const Sum value =
          plus(times(sum_of(arm), sum.terms[0].factor), constant_sum(sum.type, sum.constant));
      return make_const(Bool(), int64_t{value.valid && value.constant == 0});
    };
    if (choice && is_const(choice->when_true) && is_const(choice->when_false)) {
      return select(choice->condition, is_zero_with(choice->when_true),
                    is_zero_with(choice->when_false));
    }
  }
  if (sum.may_be_extreme()) return binary(Kind::EQ, a, b);
  const int64_t g = common_factor(sum);
  if (sum.constant % g != 0) return const_false();
  divide_by_common_factor(sum);
  const Sides sides = sides_of(sum);
  if (!sides.left.valid || !sides.right.valid || sum.constant == INT64_MIN)
    return binary(Kind::EQ, a, b);
  Sum left = sides.left, right = sides.right;
  if (left.is_constant()) std::swap(left, right), sum.constant = -sum.constant;
  // The constant goes to the right: x == y + 3.
  if (right.is_constant() || sum.constant < 0)
    right.add_constant(-sum.constant);
  else
    left.add_constant(sum.constant);
  if (!left.valid || !right.valid) return binary(Kind::EQ, a, b);
  Expr result = binary(Kind::EQ, rebuild(left), rebuild(right));
  if (const std::optional<bool> known = facts_.decided(result))
    return make_const(Bool(), int64_t{*known});
  return result;
}

Expr Simplifier::less(Kind kind, const Expr& a, const Expr& b) {
  const int lanes = a.type().lanes();
  if (a.type().is_int_or_uint()) {
    const ConstantRange ra = facts_.range(a), rb = facts_.range(b);
    const int64_t slack = kind == Kind::LE ? 0 : 1;
    if (ra.max != INT64_MAX && rb.min != INT64_MIN && ra.max <= rb.min - slack)
      return const_true(lanes);
    if (ra.min != INT64_MIN && rb.max != INT64_MAX &&
        (kind == Kind::LE ? ra.min > rb.max : ra.min >= rb.max)) {
      return const_false(lanes);
    }
    if (equal(a, b)) return make_const(Bool(lanes), int64_t{kind == Kind::LE});
  } else if (kind == Kind::LT && equal(a, b)) {
    return const_false(lanes);  // a NaN is not less than itself either
  }
  if (!is_scalar_index(a)) {
    if (const Expr both = compare_vectors(kind, a, b); both.defined()) return both;
    return binary(kind, a, b);
  }
  Sum sum = plus(sum_of(a), sum_of(b), -1);
  if (kind == Kind::LE) sum.add_constant(-1);  // x <= 0 is x - 1 < 0
  Expr result = sum.valid ? less_than_zero(sum) : Expr();
  return result.defined() ? result : binary(kind, a, b);
}

Expr Simplifier::less_than_zero(Sum sum) {
  while (cancel_names(sum)) {
  }
  if (sum.is_constant()) return make_const(Bool(), int64_t{sum.constant < 0});
  divide_by_common_factor(sum);
  if (facts_.upper_bound(sum) < 0) return const_true();
  if (facts_.lower_bound(sum) >= 0) return const_false();
  if (Expr unfolded = unfold_division(sum); unfolded.defined()) return unfolded;
  if (Expr distributed = distribute_comparison(sum); distributed.defined()) return distributed;
  Expr result = compare_sides(sum);
  if (!result.defined()) return result;
  if (const std::optional<bool> known = facts_.decided(result))
    return make_const(Bool(), int64_t{*known});
  return result;
}

// min(x, y) < z => x < z || y < z, when one of the two is decided; max with && and a select between
// constants alike.
Expr Simplifier::distribute_comparison(const Sum& sum) {
  if (depth_ > 8) return {};
  for (const Term& term : sum.terms) {
    const auto with = [&](const Expr& operand) {
      Sum replaced = sum;
      replaced.add(term.atom, -term.factor);
      replaced.add(sum_of(operand), term.factor);
      if (!replaced.valid || replaced.terms.size() > sum.terms.size() + 1) return Expr();
      depth_ += 4;  // limits how deep nests of these are explored
      Expr result = less_than_zero(replaced);
      depth_ -= 4;
      return result;
    };
    if (const auto* n = term.atom.as<Select>();
        n && is_const(n->when_true) && is_const(n->when_false)) {
      const Expr t = with(n->when_true), f = with(n->when_false);
      if (t.defined() && f.defined() && (is_const(t) || is_const(f)))
        return select(n->condition, t, f);
    }
    if (term.atom.kind() != Kind::Min && term.atom.kind() != Kind::Max) continue;
    const auto* n = term.atom.as<Binary>();
    const Expr a = with(n->a), b = with(n->b);
    if (!a.defined() || !b.defined() || (!is_const(a) && !is_const(b))) continue;
    return logical((n->kind == Kind::Min) == (term.factor > 0) ? Kind::Or : Kind::And, a, b);
  }
  return {};
}

// x / c < k => x < k c, and k < x / c => (k + 1) c <= x
Expr Simplifier::unfold_division(const Sum& sum) {
  if (sum.terms.size() != 1) return {};
  const auto& [atom, factor] = sum.terms[0];
  const auto* n = atom.as<Div>();
  const std::optional<int64_t> c = n ? as_const_int(n->b) : std::nullopt;
  if (!c || *c < 1) return {};
  if (factor != 1 && factor != -1) return {};
  // factor 1: x / c < -constant. factor -1: constant < x / c, which is not (x / c < constant + 1).
  const __int128 limit =
      factor == 1 ? -__int128{sum.constant} * *c : (__int128{sum.constant} + 1) * *c;
  if (limit > sum.type.max_int() || limit < sum.type.min_int()) return {};
  const Expr bound = make_const(sum.type, static_cast<int64_t>(limit));
  return factor == 1 ? less(Kind::LT, n->a, bound) : less(Kind::LE, bound, n->a);
}

// left + constant < right, written with the fewest constants.
Expr Simplifier::compare_sides(const Sum& sum) {
  if (sum.may_be_extreme()) return {};
  Sides sides = sides_of(sum);
  Sum& left = sides.left;
  Sum& right = sides.right;
  Kind kind = Kind::LT;
  if (right.is_constant()) {
    right.add(constant_sum(sum.type, sum.constant), -1);
  } else if (left.is_constant() || sum.constant > 0) {
    left.add_constant(sum.constant);
  } else if (sum.constant < 0) {  // left - k < right is left <= right + (k - 1)
    right.add(constant_sum(sum.type, sum.constant + 1), -1);
    kind = Kind::LE;
  }
  if (!left.valid || !right.valid) return {};
  return binary(kind, rebuild(left), rebuild(right));
}

// Vectors compare lane by lane: the result is decided only if it is the same for all lanes.
Expr Simplifier::compare_vectors(Kind kind, const Expr& a, const Expr& b) {
  if (!is_index_type(a.type()) || a.type().is_scalar()) return {};
  const bool lines = (a.kind() == Kind::Ramp || a.kind() == Kind::Broadcast) &&
                     (b.kind() == Kind::Ramp || b.kind() == Kind::Broadcast);
  if (!lines) return {};
  const int lanes = a.type().lanes();
  const Expr difference = apply(Kind::Sub, a, b);
  if (const auto* splat = difference.as<Broadcast>(); splat && splat->value.type().is_scalar()) {
    return broadcast(apply(kind, splat->value, make_zero(splat->value.type())), splat->lanes);
  }
  const auto* line = difference.as<Ramp>();
  if (!line || !is_scalar_index(line->base)) return {};
  // The first and the last lane are the extremes.
  const auto lane = [&](int i) {
    Sum sum = plus(sum_of(line->base), sum_of(line->stride), i);
    return std::pair(facts_.lower_bound(sum), facts_.upper_bound(sum));
  };
  const auto [low_first, high_first] = lane(0);
  const auto [low_last, high_last] = lane(line->lanes - 1);
  const int64_t low = std::min(low_first, low_last), high = std::max(high_first, high_last);
  if (kind == Kind::EQ) return low > 0 || high < 0 ? const_false(lanes) : Expr();
  const int64_t slack = kind == Kind::LE ? 1 : 0;
  if (high < slack) return const_true(lanes);
  return low >= slack ? const_false(lanes) : Expr();
}

}  // namespace retrograde::simplification

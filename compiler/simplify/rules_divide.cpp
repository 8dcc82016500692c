// Division and modulus by a constant c > 1. Terms that c divides move out of the quotient. The
// remaining ones are reduced by common factors, decided by their range, or merged with an inner
// division.
#include <numeric>

#include "ir/build.h"
#include "ir/scalar.h"
#include "simplify/simplifier.h"

namespace retrograde::simplification {

Expr Simplifier::div(const Expr& a, const Expr& b) {
  const std::optional<int64_t> c = as_const_int(b);
  if (!has_sums(a.type()) || !c || is_const(a)) return binary(Kind::Div, a, b);
  if (*c > 1) return div_by(a, *c);
  // The remainder is never negative, so x / -c is -(x / c).
  if (*c < 0 && is_index_type(a.type()) && *c != a.type().min_int()) {
    return sub(make_zero(a.type()), apply(Kind::Div, a, constant(a, -*c)));
  }
  return binary(Kind::Div, a, b);
}

Expr Simplifier::mod(const Expr& a, const Expr& b) {
  const std::optional<int64_t> c = as_const_int(b);
  if (!has_sums(a.type()) || !c || is_const(a)) return binary(Kind::Mod, a, b);
  if (*c > 1) return mod_by(a, *c);
  if (*c < 0 && *c != a.type().min_int()) return apply(Kind::Mod, a, constant(a, -*c));
  return binary(Kind::Mod, a, b);
}

Expr Simplifier::div_by(const Expr& a, int64_t c) {
  const ConstantRange range = facts_.range(a);
  if (range.min != INT64_MIN && range.max != INT64_MAX &&
      euclidean_div(range.min, c) == euclidean_div(range.max, c)) {
    return constant(a, euclidean_div(range.min, c));
  }
  const auto* inner = a.as<Div>();
  const std::optional<int64_t> inner_divisor = inner ? as_const_int(inner->b) : std::nullopt;
  if (inner_divisor && *inner_divisor > 1) {
    const __int128 product = __int128{*inner_divisor} * c;
    if (product <= a.type().max_int())
      return apply(Kind::Div, inner->a, constant(a, static_cast<int64_t>(product)));
  }
  if (!is_index_type(a.type())) return binary(Kind::Div, a, constant(a, c));
  if (const auto* line = a.as<Ramp>()) {
    if (Expr result = div_vector(*line, c); result.defined()) return result;
  }
  DividedSum split = divide_terms(sum_of(a), c);
  if (!split.quotient.valid || !split.remainder.valid) return binary(Kind::Div, a, constant(a, c));
  // (x + k) / c => x / c + (r + k) / c, when x is congruent to r
  Sum terms = split.remainder;
  terms.constant = 0;
  if (const std::optional<int64_t> r = facts_.congruence(terms).modulo(c)) {
    split.quotient.add_constant(euclidean_div(*r + split.remainder.constant, c));
    split.remainder.constant = 0;
  }
  const Sum rest = sum_of(div_atom(split.remainder, c));
  return rebuild(plus(split.quotient, rest), Kind::Div, a, constant(a, c));
}

// The multiple of c at or below x, if the lower end of a variable in x determines it. For x between
// 8 k + 2 and 8 k + 7 it is 8 k.
std::optional<Sum> Simplifier::multiple_below(const Sum& x, int64_t c) {
  for (const Term& term : x.terms) {
    const auto* variable = term.atom.as<Variable>();
    const Expr min = variable && term.factor > 0 ? facts_.min_of(variable->name) : Expr();
    if (!min.defined() || is_const(min) || min.type() != x.type) continue;
    if (facts_.value_of(variable->name).defined()) continue;
    Sum base = x;
    base.add(term.atom, -term.factor);
    base.add(sum_of(min), term.factor);
    const std::optional<int64_t> r = facts_.congruence(base).modulo(c);
    if (!base.valid || !r) continue;
    base.add_constant(-*r);
    const Sum offset = plus(x, base, -1);
    if (base.valid && facts_.lower_bound(offset) >= 0 && facts_.upper_bound(offset) < c)
      return base;
  }
  return std::nullopt;
}

// rest / c, where c divides no term and the constant lies in [0, c).
Expr Simplifier::div_atom(const Sum& rest, int64_t c) {
  const auto as_constant = [&](int64_t value) { return make_const(rest.type, value); };
  if (rest.is_constant()) return as_constant(0);
  const int64_t low = facts_.lower_bound(rest), high = facts_.upper_bound(rest);
  if (low != INT64_MIN && high != INT64_MAX && euclidean_div(low, c) == euclidean_div(high, c)) {
    return as_constant(euclidean_div(low, c));
  }
  if (const std::optional<Sum> base = multiple_below(rest, c))
    return apply(Kind::Div, rebuild(*base), as_constant(c));
  // (g x + k) / (g c) => (x + k / g) / c
  const int64_t g = std::gcd(common_factor(rest), c);
  if (g > 1) {
    Sum reduced = constant_sum(rest.type, euclidean_div(rest.constant, g));
    for (const Term& term : rest.terms) reduced.add(term.atom, term.factor / g);
    return apply(Kind::Div, rebuild(reduced), as_constant(c / g));
  }
  if (rest.terms.size() == 1 && rest.terms[0].factor == 1) {
    // (x / d + k) / c => (x + k d) / (c d)
    const Expr& atom = rest.terms[0].atom;
    const auto* inner = atom.as<Div>();
    const std::optional<int64_t> d = inner ? as_const_int(inner->b) : std::nullopt;
    if (d && *d > 1 && __int128{*d} * c <= rest.type.max_int() / 2) {
      Sum numerator = sum_of(inner->a);
      numerator.add_constant(rest.constant * *d);
      if (numerator.valid) return apply(Kind::Div, rebuild(numerator), as_constant(c * *d));
    }
    // min(a, b) / c => min(a / c, b / c), when one of the two divides
    if (atom.kind() == Kind::Min || atom.kind() == Kind::Max) {
      const auto* n = atom.as<Binary>();
      const auto operand = [&](const Expr& e) {
        return apply(Kind::Div, apply(Kind::Add, e, as_constant(rest.constant)), as_constant(c));
      };
      const Expr a = operand(n->a), b = operand(n->b);
      const auto divided = [](const Expr& e) {
        return e.kind() != Kind::Div && e.kind() != Kind::Add && e.kind() != Kind::Sub;
      };
      if (divided(a) || divided(b)) return apply(atom.kind(), a, b);
    }
  }
  return binary(Kind::Div, to_expr(rest), as_constant(c));
}

Expr Simplifier::mod_by(const Expr& a, int64_t c) {
  const ConstantRange range = facts_.range(a);
  if (range.min >= 0 && range.max < c) return a;
  if (!is_index_type(a.type())) return binary(Kind::Mod, a, constant(a, c));
  if (const auto* line = a.as<Ramp>()) {
    if (Expr result = mod_vector(*line, c); result.defined()) return result;
  }
  Sum rest = divide_terms(sum_of(a), c).remainder;
  if (!rest.valid) return binary(Kind::Mod, a, constant(a, c));
  if (const std::optional<int64_t> known = facts_.congruence(rest).modulo(c))
    return constant(a, *known);
  if (const std::optional<Sum> base = multiple_below(rest, c))
    return rebuild(plus(rest, *base, -1));
  // f * (x % m) => f * x, when c divides f * m
  for (const Term& term : Sum(rest).terms) {
    const auto* inner = term.atom.as<Mod>();
    const std::optional<int64_t> m = inner ? as_const_int(inner->b) : std::nullopt;
    if (!m || *m <= 0 || (__int128{term.factor} * *m) % c != 0) continue;
    Sum opened = rest;
    opened.add(term.atom, -term.factor);
    opened.add(sum_of(inner->a), term.factor);
    if (!opened.valid) continue;
    return apply(Kind::Mod, rebuild(divide_terms(opened, c).remainder), constant(a, c));
  }
  for (Term& term : rest.terms) {  // factors into (-c, c): -1 stays, 5 % 4 becomes 1
    if (term.factor >= c || term.factor <= -c) term.factor = euclidean_mod(term.factor, c);
  }
  if (rest.is_constant()) return constant(a, rest.constant);
  const int64_t low = facts_.lower_bound(rest), high = facts_.upper_bound(rest);
  if (low != INT64_MIN && high != INT64_MAX && euclidean_div(low, c) == euclidean_div(high, c)) {
    rest.add_constant(-euclidean_div(low, c) * c);
    if (rest.valid) return rebuild(rest);
  }
  // (g x + g k + j) % (g c) => g ((x + k) % c) + j, with 0 <= j < g
  const int64_t g = std::gcd(common_factor(rest), c);
  if (g > 1 && g < c) {
    Sum reduced = constant_sum(rest.type, euclidean_div(rest.constant, g));
    for (const Term& term : rest.terms) reduced.add(term.atom, term.factor / g);
    Sum result = times(sum_of(apply(Kind::Mod, rebuild(reduced), constant(a, c / g))), g);
    result.add_constant(euclidean_mod(rest.constant, g));
    if (result.valid) return rebuild(result);
  }
  return binary(Kind::Mod, to_expr(rest), constant(a, c));
}

// A ramp whose stride c divides is divided lane by lane; one that stays between two multiples of c
// gives one quotient.
Expr Simplifier::div_vector(const Ramp& a, int64_t c) {
  const std::optional<int64_t> stride = as_const_int(a.stride);
  if (!stride || a.base.type().is_vector()) return {};
  const Expr divisor = constant(a.base, c);
  if (*stride % c == 0)
    return ramp(apply(Kind::Div, a.base, divisor), constant(a.base, *stride / c), a.lanes);
  const ConstantRange offset = facts_.range(apply(Kind::Mod, a.base, divisor));
  const ConstantRange last = offset + ConstantRange::point(*stride * (a.lanes - 1));
  if (*stride > 0 && last.max < c) return broadcast(apply(Kind::Div, a.base, divisor), a.lanes);
  return {};
}

Expr Simplifier::mod_vector(const Ramp& a, int64_t c) {
  const std::optional<int64_t> stride = as_const_int(a.stride);
  if (!stride || a.base.type().is_vector()) return {};
  const Expr offset = apply(Kind::Mod, a.base, constant(a.base, c));
  if (*stride % c == 0) return broadcast(offset, a.lanes);
  const ConstantRange last = facts_.range(offset) + ConstantRange::point(*stride * (a.lanes - 1));
  if (*stride > 0 && last.max < c) return ramp(offset, a.stride, a.lanes);
  return {};
}

}  // namespace retrograde::simplification

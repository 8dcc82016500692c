// Sums: gathers like terms; x / c * c + x % c becomes x; a sum moves into an operand of min or max
// if terms cancel there.
#include <cmath>

#include "ir/build.h"
#include "ir/join_clamps.h"
#include "simplify/simplifier.h"

namespace retrograde::simplification {

namespace {

std::optional<int64_t> constant_divisor(const Expr& e, Kind kind) {
  if (e.kind() != kind) return std::nullopt;
  const std::optional<int64_t> c = as_const_int(e.as<Binary>()->b);
  return c && *c > 1 ? c : std::nullopt;
}

// Whether the sum contains factor * x, apart from the constant of x.
bool contains(const Sum& sum, const Sum& x, int64_t factor) {
  for (const Term& term : x.terms) {
    const Term* found = sum.find(term.atom);
    if (!found || __int128{found->factor} != __int128{term.factor} * factor) return false;
  }
  return !x.terms.empty();
}

}  // namespace

Expr Simplifier::add(const Expr& a, const Expr& b) {
  if (!has_sums(a.type())) return float_arithmetic(Kind::Add, a, b);
  return rebuild(plus(sum_of(a), sum_of(b)), Kind::Add, a, b);
}

Expr Simplifier::sub(const Expr& a, const Expr& b) {
  if (!has_sums(a.type())) return float_arithmetic(Kind::Sub, a, b);
  return rebuild(plus(sum_of(a), sum_of(b), -1), Kind::Sub, a, b);
}

Expr Simplifier::mul(const Expr& a, const Expr& b) {
  if (!has_sums(a.type())) return float_arithmetic(Kind::Mul, a, b);
  if (const std::optional<int64_t> c = as_const_int(b))
    return rebuild(times(sum_of(a), *c), Kind::Mul, a, b);
  if (const std::optional<int64_t> c = as_const_int(a))
    return rebuild(times(sum_of(b), *c), Kind::Mul, b, a);
  if (a.type().is_vector()) {
    for (const auto& [x, y] : {std::pair(a, b), std::pair(b, a)}) {
      const auto* slope = x.as<Ramp>();
      const auto* splat = y.as<Broadcast>();
      if (!slope || !splat || slope->lanes != splat->lanes) continue;
      return ramp(apply(Kind::Mul, slope->base, splat->value),
                  apply(Kind::Mul, slope->stride, splat->value), slope->lanes);
    }
  }
  // (2 * x) * (3 * y) => 6 * (x * y)
  const Sum x = sum_of(a), y = sum_of(b);
  if (x.terms.size() == 1 && y.terms.size() == 1 && x.constant == 0 && y.constant == 0 &&
      (x.terms[0].factor != 1 || y.terms[0].factor != 1)) {
    const __int128 factor = __int128{x.terms[0].factor} * y.terms[0].factor;
    Expr product = apply(Kind::Mul, x.terms[0].atom, y.terms[0].atom);
    if (factor == static_cast<int64_t>(factor)) {
      return rebuild(times(sum_of(product), static_cast<int64_t>(factor)), Kind::Mul, a, b);
    }
  }
  return canonical_less(b, a) ? binary(Kind::Mul, b, a) : binary(Kind::Mul, a, b);
}

// The sum as an expression; the plain node when the sum is too large or would overflow.
Expr Simplifier::rebuild(Sum sum, Kind kind, const Expr& a, const Expr& b) {
  if (!sum.valid || sum.terms.size() > max_terms) return binary(kind, a, b);
  return rebuild(std::move(sum));
}

Expr Simplifier::rebuild(Sum sum) {
  const auto build = [&](Kind kind, const Expr& a, const Expr& b) { return apply(kind, a, b); };
  while (cancel_names(sum) || join_divisions(sum) || expand_product(sum) ||
         join_clamps(sum, build)) {
  }
  if (!sum.type.is_vector()) {
    if (Expr pushed = push_into_min_max(sum); pushed.defined()) return pushed;
    if (Expr folded = fold_select(sum); folded.defined()) return folded;
    return to_expr(sum);
  }
  Expr gathered = gather_vectors(sum);
  return gathered.defined() ? gathered : to_expr(sum);
}

// n * c * (x / c) + n * (x % c) => n * x, and n * x - n * c * (x / c) => n * (x % c). Both follow
// from x == x / c * c + x % c. With a known remainder: n * c * (x / c) => n * x - n * remainder.
bool Simplifier::join_divisions(Sum& sum) {
  for (const Term& quotient : sum.terms) {
    const std::optional<int64_t> c = constant_divisor(quotient.atom, Kind::Div);
    if (!c || quotient.factor % *c != 0) continue;
    const int64_t n = quotient.factor / *c;
    const auto* division = quotient.atom.as<Binary>();
    if (const std::optional<int64_t> known = facts_.congruence(division->a).modulo(*c)) {
      Sum exact = sum;
      exact.add(quotient.atom, -quotient.factor);
      exact.add(sum_of(division->a), n);
      exact.add(constant_sum(sum.type, *known), -n);
      if (!exact.valid) continue;
      sum = std::move(exact);
      return true;
    }
    const Expr remainder = binary(Kind::Mod, division->a, division->b);
    const Sum x = sum_of(division->a);
    const Term* found = sum.find(remainder);
    Sum joined = sum;
    joined.add(quotient.atom, -quotient.factor);
    if (found && found->factor == n) {
      joined.add(remainder, -n);
      joined.add(x, n);
    } else if (n != INT64_MIN && contains(sum, x, -n)) {
      joined.add(x, n);
      joined.add(sum_of(mod_by(division->a, *c)), -n);
    } else {
      continue;
    }
    if (!joined.valid) continue;
    sum = std::move(joined);
    return true;
  }
  return false;
}

// (x + 1) * y - x * y => y: expands a product of a sum when fewer terms remain.
bool Simplifier::expand_product(Sum& sum) {
  if (sum.terms.size() < 2) return false;
  for (const Term& term : sum.terms) {
    const auto* product = term.atom.as<Mul>();
    if (!product) continue;
    for (const auto& [x, y] :
         {std::pair(product->a, product->b), std::pair(product->b, product->a)}) {
      if (x.kind() != Kind::Add && x.kind() != Kind::Sub) continue;
      Sum parts = constant_sum(sum.type, 0);
      const Sum inner = sum_of(x);
      for (const Term& part : inner.terms) parts.add(sum_of(mul(part.atom, y)), part.factor);
      parts.add(sum_of(y), inner.constant);
      Sum expanded = sum;
      expanded.add(term.atom, -term.factor);
      expanded.add(parts, term.factor);
      if (!expanded.valid || expanded.terms.size() >= sum.terms.size()) continue;
      sum = std::move(expanded);
      return true;
    }
  }
  return false;
}

// min(x, y + 3) - y => min(x - y, 3), when fewer terms remain.
Expr Simplifier::push_into_min_max(const Sum& sum) {
  if (!is_index_type(sum.type) || sum.terms.size() < 2) return {};
  for (const Term& term : sum.terms) {
    const Kind kind = term.atom.kind();
    if (kind != Kind::Min && kind != Kind::Max) continue;
    const auto* n = term.atom.as<Binary>();
    Sum a = times(sum_of(n->a), term.factor), b = times(sum_of(n->b), term.factor);
    const size_t before = a.terms.size() + b.terms.size();
    Sum moved = constant_sum(sum.type, 0);
    for (const Term& other : sum.terms) {
      const Term *in_a = a.find(other.atom), *in_b = b.find(other.atom);
      const bool cancels =
          (in_a && in_a->factor == -other.factor) || (in_b && in_b->factor == -other.factor);
      if (cancels && other.factor != INT64_MIN) moved.add(other.atom, other.factor);
    }
    if (moved.is_constant() || a.may_be_extreme() || b.may_be_extreme()) continue;
    Sum rest = plus(sum, moved, -1);
    rest.add(term.atom, -term.factor);
    a.add(moved, 1);
    b.add(moved, 1);
    if (!a.valid || !b.valid || !rest.valid ||
        a.terms.size() + b.terms.size() >= before + moved.terms.size())
      continue;
    const Kind pushed = (term.factor > 0) == (kind == Kind::Min) ? Kind::Min : Kind::Max;
    return apply(Kind::Add, apply(pushed, rebuild(a), rebuild(b)), rebuild(rest));
  }
  return {};
}

// select(c, 3, 4) * 2 + 1 => select(c, 7, 9)
Expr Simplifier::fold_select(const Sum& sum) {
  if (sum.terms.size() != 1) return {};
  const auto [atom, factor] = sum.terms[0];
  const auto* n = atom.as<Select>();
  if (!n || (factor == 1 && sum.constant == 0) || !is_const(n->when_true) ||
      !is_const(n->when_false))
    return {};
  const auto arm = [&, factor = factor](const Expr& value) {
    Sum folded = times(sum_of(value), factor);
    folded.add_constant(sum.constant);
    return folded;
  };
  const Sum t = arm(n->when_true), f = arm(n->when_false);
  if (!t.valid || !f.valid) return {};
  return make_select(n->condition, to_expr(t), to_expr(f));
}

// All ramps and broadcasts of scalars in a vector sum become one ramp or broadcast.
Expr Simplifier::gather_vectors(const Sum& sum) {
  const Type scalar = sum.type.element_of();
  Sum base = constant_sum(scalar, 0), stride = constant_sum(scalar, 0),
      rest = constant_sum(sum.type, 0);
  bool found = false;
  for (const Term& term : sum.terms) {
    const auto* splat = term.atom.as<Broadcast>();
    const auto* slope = term.atom.as<Ramp>();
    if (splat && splat->value.type().is_scalar()) {
      base.add(sum_of(splat->value), term.factor);
    } else if (slope && slope->base.type().is_scalar()) {
      base.add(sum_of(slope->base), term.factor);
      stride.add(sum_of(slope->stride), term.factor);
    } else {
      rest.add(term.atom, term.factor);
      continue;
    }
    found = true;
  }
  base.add_constant(sum.constant);
  if (!found || !base.valid || !stride.valid || base.terms.size() > max_terms ||
      stride.terms.size() > max_terms)
    return {};
  Expr line = ramp(rebuild(base), rebuild(stride), sum.type.lanes());
  return rest.is_constant() ? line : binary(Kind::Add, to_expr(rest), line);
}

// Exact for every value: + and * commute, and adding -x is subtracting x.
Expr Simplifier::float_arithmetic(Kind kind, const Expr& a, const Expr& b) {
  const auto negated = [](const Expr& e) {  // x, when e is -0.0 - x
    const auto* n = e.as<Sub>();
    if (!n) return Expr();
    const std::optional<double> zero = as_const_float(n->a);
    return zero && *zero == 0 && std::signbit(*zero) ? n->b : Expr();
  };
  if (kind == Kind::Add) {
    if (Expr x = negated(b); x.defined()) return binary(Kind::Sub, a, x);
    if (Expr x = negated(a); x.defined()) return binary(Kind::Sub, b, x);
  }
  if (kind == Kind::Sub) {
    if (Expr x = negated(b); x.defined()) return apply(Kind::Add, a, x);
  }
  const bool swap = kind != Kind::Sub && is_const(a) && !is_const(b);
  return swap ? binary(kind, b, a) : binary(kind, a, b);
}

}  // namespace retrograde::simplification

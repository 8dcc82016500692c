// Congruences: the value of an index expression modulo a constant. Lets pass them on to their
// names, so that a promise of align_bounds is still known deep inside loops.
//
// Sets of operands => set of the result, where {m, r} is m * Z + r, and {0, value} a constant:
//   {m, r} + {n, s}  {gcd(m, n), r + s}
//   {m, r} * {n, s}  {gcd(m n, m s, n r), r s}
//   {m, r} / c       {m / c, floor(r / c)}, when c divides m
//   either of two    {gcd(m, n, r - s), r}
// Products beyond int64 give the unknown {1, 0}.
#include <algorithm>
#include <numeric>

#include "ir/build.h"
#include "ir/scalar.h"
#include "ir/visit.h"
#include "simplify/facts.h"

namespace retrograde::simplification {

namespace {

constexpr Congruence unknown{1, 0};
constexpr int64_t limit = int64_t{1} << 31;  // products of two stay inside int64

Congruence reduced(int64_t modulus, int64_t remainder) {
  if (modulus < 0) modulus = -modulus;
  if (modulus >= limit || remainder >= limit || remainder <= -limit) return unknown;
  return {modulus, modulus == 0 ? remainder : euclidean_mod(remainder, modulus)};
}

Congruence plus(const Congruence& a, const Congruence& b) {
  return reduced(std::gcd(a.modulus, b.modulus), a.remainder + b.remainder);
}

Congruence product(const Congruence& a, const Congruence& b) {
  const int64_t modulus =
      std::gcd(std::gcd(a.modulus * b.modulus, a.modulus * b.remainder), b.modulus * a.remainder);
  return reduced(modulus, a.remainder * b.remainder);
}

Congruence quotient(const Congruence& a, int64_t divisor) {
  if (a.modulus % divisor != 0) return unknown;
  return reduced(a.modulus / divisor, euclidean_div(a.remainder, divisor));
}

Congruence either(const Congruence& a, const Congruence& b) {
  const int64_t modulus = std::gcd(std::gcd(a.modulus, b.modulus), a.remainder - b.remainder);
  return reduced(modulus, a.remainder);
}

}  // namespace

std::optional<int64_t> Congruence::modulo(int64_t divisor) const {
  if (modulus % divisor != 0) return std::nullopt;
  return euclidean_mod(remainder, divisor);
}

Congruence Facts::congruence(const Expr& e) {
  if (const std::optional<int64_t> value = as_const_int(e)) return reduced(0, *value);
  if (!is_index_type(e.type())) return unknown;
  return congruences_.get(e, [&] { return congruence_of_node(e); });
}

Congruence Facts::congruence(const Sum& sum) {
  Congruence result = reduced(0, sum.constant);
  for (const Term& term : sum.terms)
    result = plus(result, product(reduced(0, term.factor), congruence(term.atom)));
  return result;
}

// x % c == r, and (x + k) % c == r.
void Facts::assume_congruent(const Expr& remainder, const Expr& value) {
  const auto* n = remainder.as<Mod>();
  const auto divisor = n ? as_const_int(n->b) : std::nullopt, known = as_const_int(value);
  if (!divisor || *divisor <= 0 || *divisor >= limit || !known) return;
  const Sum sum = sum_of(n->a);
  if (sum.terms.size() != 1 || sum.terms[0].factor != 1) return;
  const auto* variable = sum.terms[0].atom.as<Variable>();
  if (!variable) return;
  congruent_.push_back(
      {variable->name, {*divisor, euclidean_mod(*known - sum.constant, *divisor)}});
}

// A condition on a variable also applies to enclosing lets that derive from the variable.
Congruence Facts::congruence_of_variable(const Variable& n) {
  const auto is_it = [&](const Congruent& c) { return c.name == n.name; };
  const auto assumed = std::ranges::find_if(congruent_, is_it);
  if (assumed != congruent_.end()) return assumed->congruence;
  const auto found = variables_.find(n.name);
  if (found == variables_.end()) return unknown;
  const Bounds& bounds = found->second;
  const bool may_know_more = !congruent_.empty() && bounds.congruence.modulus == 1 &&
                             bounds.min.defined() && bounds.min.same_as(bounds.max);
  return may_know_more ? congruence(Expr(bounds.min)) : bounds.congruence;
}

Congruence Facts::congruence_of_node(const Expr& e) {
  if (const auto* n = e.as<Variable>()) return congruence_of_variable(*n);
  if (const auto* n = e.as<Select>()) {
    return either(congruence(n->when_true), congruence(n->when_false));
  }
  const auto* n = e.as<Binary>();
  if (!n) return unknown;
  const std::optional<int64_t> divisor = as_const_int(n->b);
  switch (n->kind) {
    case Kind::Add:
      return plus(congruence(n->a), congruence(n->b));
    case Kind::Sub:
      return plus(congruence(n->a), product({0, -1}, congruence(n->b)));
    case Kind::Mul:
      return product(congruence(n->a), congruence(n->b));
    case Kind::Min:
    case Kind::Max:
      return either(congruence(n->a), congruence(n->b));
    case Kind::Div:
      return divisor && *divisor > 0 ? quotient(congruence(n->a), *divisor) : unknown;
    default:
      return unknown;
  }
}

}  // namespace retrograde::simplification

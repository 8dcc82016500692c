#include "autodiff/rules/stable_norms.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "autodiff/rules/stable_patterns.h"
#include "ir/build.h"
#include "ir/equal.h"

namespace retrograde::autodiff {

namespace {

// Returns a if e is a * a or pow(a, 2), else an undefined Expr.
Expr square_root_of(const Expr& e) {
  if (const auto* product = e.as<Mul>()) return equal(product->a, product->b) ? product->a : Expr();
  const Call* power = as_op(e, Op::pow);
  return power && as_const_float(power->args[1]) == 2.0 ? power->args[0] : Expr();
}

// The components of the norm whose square is `sum`; a constant term counts as the square of its root. Empty if `sum` is
// no sum of squares.
std::vector<Expr> components_of(const Expr& sum) {
  std::vector<Expr> result;
  for (const Expr& term : terms_of(sum)) {
    auto constant = as_const_float(term);
    Expr a = !constant        ? square_root_of(term)
             : *constant >= 0 ? make_const(term.type(), std::sqrt(*constant))
                              : Expr();
    if (!a.defined()) return {};
    result.push_back(a);
  }
  return result;
}

std::vector<Expr> components_of_norm(const Expr& e) {
  if (const Call* hypot = as_op(e, Op::hypot)) return hypot->args;
  const Call* root = as_op(e, Op::sqrt);
  return root ? components_of(root->args[0]) : std::vector<Expr>{};
}

// A vector as direction and length: a_i = u_i |a|, |a| = scale / inverse.
struct Polar {
  std::vector<Expr> u;
  Expr scale, inverse;
  Expr over_length(const Expr& e) const { return e * inverse / scale; }
};

// Divides by the largest of |a_1|, ..., |a_n| first, because the sum of squares may overflow. The derivative of that
// scale cancels, so the scale is not differentiated.
Polar polar(const std::vector<Expr>& a) {
  const Expr zero = make_zero(a[0].type());
  Expr scale, squares, at_origin;
  for (const Expr& e : a) {
    const Expr size = call_op(Op::abs, {e}), is_zero = e == zero;
    scale = scale.defined() ? binary(Kind::Max, scale, size) : size;
    at_origin =
        at_origin.defined() ? at_origin && is_zero : is_zero;  // false if a component is NaN
  }
  scale = call_op(Op::stop_gradient, {scale});
  Polar result{{}, scale, {}};
  for (const Expr& e : a) {
    result.u.push_back(e / scale);
    add_term(squares, result.u.back() * result.u.back());
  }
  result.inverse = make_one(scale.type()) / call_op(Op::sqrt, {squares});
  for (Expr& e : result.u) e = make_select(at_origin, zero, e * result.inverse);
  return result;
}

// v = a_i / |a|, or v = a_i / max(|a|, c).
struct Normalised {
  Expr component;
  std::vector<Expr> a;
  Expr norm, floor;  // undefined: no max
};

// With u = a / |a|:  d/da_i = (sum of the other u_j^2) / |a|, d/da_j = -u_i u_j / |a|
// With max(|a|, c) these hold for |a| above the constant c; below it the partials are 1 / c and 0.
StableForm form_of(const Normalised& v) {
  size_t own = 0;
  while (own < v.a.size() && !equal(v.a[own], v.component)) ++own;
  if (v.a.size() < 2 || own == v.a.size()) return {};
  const Polar p = polar(v.a);
  StableForm result;
  auto add = [&](size_t j, const Expr& above, const Expr& below) {
    result.add(v.a[j],
               strong(v.floor.defined() ? make_select(v.norm > v.floor, above, below) : above));
  };
  Expr others, zero = make_zero(v.component.type());
  for (size_t j = 0; j < v.a.size(); ++j) {
    if (j == own) continue;
    Expr scaled = p.over_length(p.u[j]);
    add_term(others, scaled * p.u[j]);
    if (!is_const(v.a[j])) add(j, -(scaled * p.u[own]), zero);
  }
  add(own, others, v.floor.defined() ? make_one(zero.type()) / v.floor : zero);
  return result;
}

StableForm of_quotient(const Div& quotient) {
  const auto* bounded = quotient.b.as<Max>();
  if (bounded && !is_const(bounded->b)) return {};
  const Expr& norm = bounded ? bounded->a : quotient.b;
  return form_of({quotient.a, components_of_norm(norm), norm, bounded ? bounded->b : Expr()});
}

// The components of a if e is 1 / |a|, else empty.
std::vector<Expr> components_of_reciprocal(const Expr& e) {
  const auto* quotient = e.as<Div>();
  if (quotient && is_one(quotient->a)) return components_of_norm(quotient->b);
  if (const Call* inverse = as_op(e, Op::fast_inverse_sqrt)) return components_of(inverse->args[0]);
  const Call* power = as_op(e, Op::pow);
  const bool is_root = power && as_const_float(power->args[1]) == -0.5;
  return is_root ? components_of(power->args[0]) : std::vector<Expr>{};
}

// v = 1 / |a|:  d/da_i = -u_i / |a| / |a|, and 0 where a is infinite.
StableForm of_reciprocal(const Expr& e) {
  const std::vector<Expr> a = components_of_reciprocal(e);
  if (a.empty()) return {};
  const Polar p = polar(a);
  const Expr infinite = call_op(Op::is_inf, Bool(e.type().lanes()), {p.scale});
  StableForm result;
  for (size_t i = 0; i < a.size(); ++i) {
    if (is_const(a[i])) continue;
    const Expr partial = -p.over_length(p.over_length(p.u[i]));
    result.add(a[i], strong(make_select(infinite, make_zero(e.type()), partial)));
  }
  return result;
}

}  // namespace

// v = |a|:  d/da_i = a_i / |a|. If one of the squares is a constant, the quotients do not underflow.
StableForm norm_form(const Expr& e) {
  const Call* root = as_op(e, Op::sqrt);
  StableForm result{root ? components_of(root->args[0]) : std::vector<Expr>{}, {}};
  if (std::ranges::any_of(result.operands, [](const Expr& a) { return is_const(a); })) return {};
  if (!result.is_found()) return {};
  for (const Expr& component : unit_vector(result.operands))
    result.partials.push_back(strong(component));
  return result;
}

namespace {

// How deep products of products are searched. The limit keeps long chains of products linear in time.
constexpr int deepest_product = 2;

void add_factors(const Expr& e, int depth, std::vector<Expr>& factors) {
  const auto* product = e.as<Mul>();
  if (!product || depth > deepest_product) return factors.push_back(e);
  add_factors(product->a, depth + 1, factors);
  add_factors(product->b, depth + 1, factors);
}

// The factors of a product in which one norm occurs twice, with these two last; empty for other expressions.
std::vector<Expr> with_square_last(const Expr& e) {
  if (const Expr root = square_root_of(e); root.defined() && !e.as<Mul>()) return {root, root};
  std::vector<Expr> factors;
  if (e.as<Mul>()) add_factors(e, 0, factors);
  for (size_t i = 0; i < factors.size(); ++i) {
    if (components_of_norm(factors[i]).empty()) continue;
    for (size_t j = i + 1; j < factors.size(); ++j) {
      if (!equal(factors[i], factors[j])) continue;
      std::swap(factors[j], factors.back());
      std::swap(factors[i], factors[factors.size() - 2]);
      return factors;
    }
  }
  return {};
}

// The product of all factors except `own`; undefined if there is no other factor.
Expr product_without(const std::vector<Expr>& factors, size_t own) {
  Expr product;
  for (size_t i = 0; i < factors.size(); ++i) {
    if (i != own) product = product.defined() ? product * factors[i] : factors[i];
  }
  return product;
}

}  // namespace

// v = r |a|^2:  d/da_i = r 2 a_i, d/dr = |a|^2. Differentiated through |a|, d/da_i would be 2 r |a| times the unit
// vector. That agrees except at the origin, where |a| has no derivative, and where this form also gives the right
// second derivative, 2 r.
StableForm squared_norm_form(const Expr& e) {
  std::vector<Expr> factors = with_square_last(e);
  if (factors.empty()) return {};
  const Expr norm = factors.back();
  factors.resize(factors.size() - 2);
  StableForm result;
  const Expr others = product_without(factors, factors.size());
  for (const Expr& a : components_of_norm(norm)) {
    if (is_const(a)) continue;
    const Expr slope = make_const(a.type(), 2) * a;
    result.add(a, {others.defined() ? others * slope : slope, Strength::Plain});
  }
  for (size_t i = 0; i < factors.size() && result.is_found(); ++i) {
    if (is_const(factors[i])) continue;
    const Expr rest = product_without(factors, i), square = norm * norm;
    result.add(factors[i], {rest.defined() ? rest * square : square, Strength::Plain});
  }
  return result;
}

StableForm normalised_form(const Expr& e) {
  StableForm result;
  if (const auto* quotient = e.as<Div>()) result = of_quotient(*quotient);
  if (const auto* product = e.as<Mul>()) {
    result = form_of({product->a, components_of_reciprocal(product->b), {}, {}});
    if (!result.is_found())
      result = form_of({product->b, components_of_reciprocal(product->a), {}, {}});
  }
  return !result.is_found() ? of_reciprocal(e) : result;
}

std::vector<Expr> unit_vector(const std::vector<Expr>& a) { return polar(a).u; }

// y and x are divided by the larger magnitude, so that y^2 + x^2 neither overflows nor underflows.
std::vector<Expr> angle_gradient(const Expr& y, const Expr& x) {
  const Expr zero = make_zero(x.type()), size_x = call_op(Op::abs, {x}),
             size_y = call_op(Op::abs, {y});
  const Expr infinity = make_const(x.type(), std::numeric_limits<double>::infinity());
  Expr scale = binary(Kind::Max, size_x, size_y), along_y = y / scale, along_x = x / scale;
  Expr square_sum = along_x * along_x + along_y * along_y;
  Expr nowhere = (x == zero && y == zero) || size_x == infinity || size_y == infinity;
  const auto partial = [&](const Expr& along) {
    return make_select(nowhere, zero, along / square_sum / scale);
  };
  return {partial(along_x), partial(-along_y)};
}

}  // namespace retrograde::autodiff

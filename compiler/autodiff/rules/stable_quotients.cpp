#include "autodiff/rules/stable_quotients.h"

#include <cmath>

#include "autodiff/rules/stable_patterns.h"
#include "ir/build.h"
#include "ir/equal.h"

namespace retrograde::autodiff {

namespace {

// The polynomial c_0 + c_1 x + ...
Expr polynomial(const std::vector<double>& coefficients, const Expr& x) {
  Expr result = make_const(x.type(), coefficients.back());
  for (size_t k = coefficients.size() - 1; k-- > 0;)
    result = make_const(x.type(), coefficients[k]) + x * result;
  return result;
}
// Whether x is so near 0 that the series apply.
Expr is_near(const Expr& x) { return call_op(Op::abs, x.type(), {x}) < make_const(x.type(), 0.5); }
size_t terms_for(Type type, size_t in_float, size_t in_double) {
  return type.bits() == 64 ? in_double : in_float;
}

// A numerator or denominator N that vanishes at x = 0, and its derivative by x.
struct Vanishing {
  Expr slope;           // N'
  Expr relative_slope;  // N' / N
  Expr quotient_slope;  // derivative of N / x, for |x| < 1 / 2
};

// N = t (exp(w) - 1), w = s x:  N' / N = s + s t / N,
//   d(N / x)/dx = t (1/2 + w / 3 + ... + (k - 1) w^(k-2) / k! + ...)
Vanishing exp_minus_one(const Expr& n, const Expr& x) {
  const auto* difference = n.as<Sub>();
  if (!difference) return {};
  const double t = is_one(difference->b) ? 1 : -1;
  if (t < 0 && !is_one(difference->a)) return {};
  const Expr& power = t > 0 ? difference->a : difference->b;
  const Call* exponential = as_op(power, Op::exp);
  const double s = exponential ? sign_between(exponential->args[0], x) : 0;
  if (s == 0) return {};
  std::vector<double> series;
  for (size_t k = 2; k < 2 + terms_for(x.type(), 9, 15); ++k)
    series.push_back(t * static_cast<double>(k - 1) / std::tgamma(static_cast<double>(k + 1)));
  return {make_const(x.type(), s * t) * power,
          make_const(x.type(), s) + make_const(x.type(), s * t) / n,
          polynomial(series, exponential->args[0])};
}

// N = log(1 + w), w = s x; with q = w / (2 + w), w = 2 q / (1 - q):  log(1 + w) = 2 (q + q^3 / 3 + ...),
//   d(N / x)/dx = -(1 - q)^2 / 2 (1 / (1 + q) + q (1/3 + q^2 / 5 + ...))
Vanishing log_of_one_plus(const Expr& n, const Expr& x) {
  const Call* logarithm = as_op(n, Op::log);
  if (!logarithm) return {};
  const Expr &inside = logarithm->args[0], one = make_one(x.type()), two = one + one;
  const auto* sum = inside.as<Add>();
  const auto* difference = inside.as<Sub>();
  Expr w;
  if (sum && is_one(sum->a)) w = sum->b;
  if (sum && is_one(sum->b)) w = sum->a;
  if (difference && is_one(difference->a)) w = -difference->b;
  const double s = w.defined() ? sign_between(w, x) : 0;
  if (s == 0) return {};
  const Expr q = w / (two + w);
  const std::vector<double> series = numbered(
      terms_for(x.type(), 8, 17), [&](size_t k) { return 1 / static_cast<double>(2 * k + 3); });
  const Expr rest = one / (one + q) + q * polynomial(series, q * q);
  const Expr slope = make_const(x.type(), s) / inside;
  return {slope, slope / n, make_const(x.type(), -0.5) * ((one - q) * (one - q)) * rest};
}

Vanishing vanishing(const Expr& n, const Expr& x) {
  const Expr size = without_sign(n);
  Vanishing result = exp_minus_one(size, x);
  if (!result.slope.defined()) result = log_of_one_plus(size, x);
  if (!result.slope.defined() || size.same_as(n)) return result;
  return {-result.slope, result.relative_slope, -result.quotient_slope};
}

// v = N / x:  dv/dx = (N' - v) / x.  v = x / N:  dv/dx = 1 / N - v N' / N = -v^2 d(N / x)/dx.
// The differences cancel near 0.
StableForm vanishing_quotient(const Expr& v, const Div& quotient) {
  const bool is_above = vanishing(quotient.a, quotient.b).slope.defined();
  const Expr &n = is_above ? quotient.a : quotient.b, &x = is_above ? quotient.b : quotient.a;
  const Vanishing zero = vanishing(n, x);
  if (!zero.slope.defined()) return {};
  const Expr near = is_above ? zero.quotient_slope : -(v * v * zero.quotient_slope);
  const Expr far =
      is_above ? (zero.slope - v) / x : make_one(x.type()) / n - v * zero.relative_slope;
  return {{x}, {strong(make_select(is_near(x), near, far))}};
}

// v = sin(x) / x:  dv/dx = (cos(x) - v) / x, which cancels near 0. The series there is
//   sum of (-1)^k 2k x^(2k-1) / (2k+1)!
StableForm sine_quotient(const Expr& v, const Div& quotient) {
  const Call* sine = as_op(quotient.a, Op::sin);
  const Expr& x = quotient.b;
  if (!sine || !equal(sine->args[0], x)) return {};
  std::vector<double> series;
  for (size_t k = 1; k <= terms_for(x.type(), 4, 8); ++k) {
    const double size = 2.0 * static_cast<double>(k) / std::tgamma(static_cast<double>(2 * k + 2));
    series.push_back(k % 2 ? -size : size);
  }
  const Expr cosine = call_op(Op::cos, x.type(), {x});
  return {{x}, {strong(make_select(is_near(x), polynomial(series, x * x) * x, (cosine - v) / x))}};
}

}  // namespace

StableForm quotient_form(const Expr& e, const Div& quotient) {
  const StableForm sine = sine_quotient(e, quotient);
  return !sine.is_found() ? vanishing_quotient(e, quotient) : sine;
}

}  // namespace retrograde::autodiff

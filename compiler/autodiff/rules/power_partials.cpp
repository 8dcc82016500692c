#include "autodiff/rules/power_partials.h"

#include <limits>

#include "ir/build.h"
#include "ir/scalar.h"

namespace retrograde::autodiff {

namespace {

Expr number_like(const Expr& like, double value) { return make_const(like.type(), value); }
Expr infinity(Type type) { return make_const(type, std::numeric_limits<double>::infinity()); }
double smallest_normal_of(Type type) {
  return type.bits() == 64                       ? std::numeric_limits<double>::min()
         : type.bits() == 32 || type.is_bfloat() ? std::numeric_limits<float>::min()
                                                 : 0x1p-14;
}
Expr zero_where(const Expr& condition, const Expr& e) {
  return make_select(condition, make_zero(e.type()), e);
}

// Whether p - 1 is exact in p's type.
bool has_exact_predecessor(const Expr& p) {
  auto value = as_const_float(p);
  return value && round_to_type(p.type(), *value - 1) == *value - 1;
}

}  // namespace

std::vector<Partial> power_partials(const std::vector<Expr>& a, const Expr& v, Op power,
                                    Op logarithm) {
  const Expr& x = a[0];
  const Expr at_origin = x == number_like(x, 0);
  const Expr p =
      is_const(a[1]) ? a[1] : make_select(at_origin, call_op(Op::stop_gradient, {a[1]}), a[1]);
  Expr dx = p * call_op(power, x.type(), {x, p - number_like(p, 1)});
  if (!has_exact_predecessor(p)) {
    Expr size = call_op(Op::abs, {v});
    Expr lost = size < number_like(x, smallest_normal_of(x.type())) || size == infinity(x.type()) ||
                call_op(Op::abs, {x}) == infinity(x.type());
    dx = make_select(lost, dx, p * v / x);
  }
  if (is_zero(p)) dx = number_like(x, 0);
  if (!is_const(p))
    dx = make_select(a[1] == number_like(p, 0), call_op(Op::strong_div, x.type(), {p, x}), dx);
  Expr dp = zero_where(at_origin, v * call_op(logarithm, {x}));
  return {strong(dx), strong(dp)};
}

}  // namespace retrograde::autodiff

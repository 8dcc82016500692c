// float_functions.cpp -- mathematical functions of floats: type rules, and powers with constant
// integer exponents by multiplication.
#include "frontend/language/expr_ops.h"
#include "frontend/language/operand_checks.h"
#include "ir/print.h"

namespace retrograde {

using frontend::check_defined;
using frontend::type_error;
using ir::call_op;
using ir::Op;

namespace {

Expr as_float(Expr x, const char* what) {
  check_defined(x, what);
  const Type type = x.type();
  if (type.is_handle()) type_error(what, "it takes a number", x);
  if (type.is_float() && !type.is_bfloat()) return x;
  return ir::cast_to(Float(32, type.lanes()), std::move(x));
}

Expr unary_float(Op op, Expr x) {
  const char* name = ir::op_info(op).name;
  return call_op(op, {as_float(std::move(x), name)});
}

Expr binary_float(Op op, Expr a, Expr b) {
  const char* name = ir::op_info(op).name;
  a = as_float(std::move(a), name);
  b = as_float(std::move(b), name);
  ir::match_types(a, b, name);
  return call_op(op, {a, b});
}

Expr unary_float32(Op op, Expr x) {
  const char* name = ir::op_info(op).name;
  x = as_float(std::move(x), name);
  if (x.type().element_of() != Float(32))
    type_error(name, "it takes float32", x, "Use the exact form");
  return call_op(op, {x});
}

Expr classify_float(Op op, Expr x) {
  const char* name = ir::op_info(op).name;
  x = as_float(std::move(x), name);
  return call_op(op, Bool(x.type().lanes()), {x});
}

Expr power_by_squaring(const Expr& x, int64_t exponent) {
  if (exponent == 0)  // x keeps its reduction variables until the definition
    return ir::make_select(ir::const_true(), ir::make_one(x.type()), x);
  if (exponent == 1) return x;
  Expr half = power_by_squaring(x, exponent / 2);
  return exponent % 2 ? half * half * x : half * half;
}

Expr integer_power(const Expr& x, int64_t exponent) {
  return exponent >= 0 ? power_by_squaring(x, exponent)
                       : ir::make_one(x.type()) / power_by_squaring(x, -exponent);
}

}  // namespace

Expr fma(Expr a, Expr b, Expr c) {
  bool has_float = false;
  for (const Expr& e : {a, b, c}) {
    check_defined(e, "fma");
    has_float |= e.type().is_float();
  }
  if (!has_float) type_error("fma", "it takes floats", a);
  ir::match_types(a, b, "fma");
  ir::match_types(b, c, "fma");
  ir::match_types(a, b, "fma");  // to the type of c
  return call_op(Op::fma, {a, b, c});
}

#define RETROGRADE_UNARY_FLOAT(name) \
  Expr name(Expr x) { return unary_float(Op::name, std::move(x)); }
RETROGRADE_UNARY_FLOAT(floor)
RETROGRADE_UNARY_FLOAT(ceil)
RETROGRADE_UNARY_FLOAT(round)
RETROGRADE_UNARY_FLOAT(trunc)
RETROGRADE_UNARY_FLOAT(sqrt)
RETROGRADE_UNARY_FLOAT(exp)
RETROGRADE_UNARY_FLOAT(log)
RETROGRADE_UNARY_FLOAT(sin)
RETROGRADE_UNARY_FLOAT(cos)
RETROGRADE_UNARY_FLOAT(tan)
RETROGRADE_UNARY_FLOAT(asin)
RETROGRADE_UNARY_FLOAT(acos)
RETROGRADE_UNARY_FLOAT(atan)
RETROGRADE_UNARY_FLOAT(sinh)
RETROGRADE_UNARY_FLOAT(cosh)
RETROGRADE_UNARY_FLOAT(tanh)
RETROGRADE_UNARY_FLOAT(asinh)
RETROGRADE_UNARY_FLOAT(acosh)
RETROGRADE_UNARY_FLOAT(atanh)
RETROGRADE_UNARY_FLOAT(erf)
#undef RETROGRADE_UNARY_FLOAT

Expr fract(Expr x) {
  x = as_float(std::move(x), "fract");
  return x - trunc(x);
}

Expr pow(Expr x, Expr y) {
  check_defined(x, "pow");
  check_defined(y, "pow");
  if (y.type().is_int_or_uint()) {
    if (auto exponent = ir::as_const_int(y)) return integer_power(x, *exponent);
  }
  // A square is exact but for one rounding, and takes a multiplication instead of a logarithm and an exponential.
  if (x.type() == y.type() && ir::as_const_float(y) == 2.0) return integer_power(x, 2);
  return binary_float(Op::pow, std::move(x), std::move(y));
}

Expr hypot(Expr x, Expr y) { return binary_float(Op::hypot, std::move(x), std::move(y)); }
Expr atan2(Expr y, Expr x) { return binary_float(Op::atan2, std::move(y), std::move(x)); }

Expr is_nan(Expr x) { return classify_float(Op::is_nan, std::move(x)); }
Expr is_inf(Expr x) { return classify_float(Op::is_inf, std::move(x)); }
Expr is_finite(Expr x) { return classify_float(Op::is_finite, std::move(x)); }

Expr fast_exp(Expr x) { return unary_float32(Op::fast_exp, std::move(x)); }
Expr fast_log(Expr x) { return unary_float32(Op::fast_log, std::move(x)); }
Expr fast_sin(Expr x) { return unary_float32(Op::fast_sin, std::move(x)); }
Expr fast_cos(Expr x) { return unary_float32(Op::fast_cos, std::move(x)); }
Expr fast_inverse(Expr x) { return unary_float32(Op::fast_inverse, std::move(x)); }
Expr fast_inverse_sqrt(Expr x) { return unary_float32(Op::fast_inverse_sqrt, std::move(x)); }

Expr fast_pow(Expr x, Expr y) {
  check_defined(y, "fast_pow");
  if (y.type().is_int_or_uint()) {
    check_defined(x, "fast_pow");
    if (auto exponent = ir::as_const_int(y)) return integer_power(x, *exponent);
  }
  x = as_float(std::move(x), "fast_pow");
  y = as_float(std::move(y), "fast_pow");
  if (x.type().element_of() != Float(32)) type_error("fast_pow", "it takes float32", x, "Use pow");
  if (y.type().element_of() != Float(32)) type_error("fast_pow", "it takes float32", y, "Use pow");
  return call_op(Op::fast_pow, {x, y});
}

}  // namespace retrograde

// Reference values of mathematical operators in long double, and errors in units of the last place (ULP). Long double
// has at least 11 bits more than float64, so the error of a reference is negligible.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "ir/operators.h"

namespace retrograde {

// The operator's value at x, or at (x, y) if it has two operands.
inline long double reference_value(ir::Op op, long double x, long double y) {
  using ir::Op;
  switch (op) {
    case Op::exp:
    case Op::fast_exp:
      return std::exp(x);
    case Op::log:
    case Op::fast_log:
      return std::log(x);
    case Op::pow:
    case Op::fast_pow:
      return std::pow(x, y);
    case Op::hypot:
      return std::hypot(x, y);
    case Op::sin:
    case Op::fast_sin:
      return std::sin(x);
    case Op::cos:
    case Op::fast_cos:
      return std::cos(x);
    case Op::tan:
      return std::tan(x);
    case Op::asin:
      return std::asin(x);
    case Op::acos:
      return std::acos(x);
    case Op::atan:
      return std::atan(x);
    case Op::atan2:
      return std::atan2(x, y);
    case Op::sinh:
      return std::sinh(x);
    case Op::cosh:
      return std::cosh(x);
    case Op::tanh:
      return std::tanh(x);
    case Op::asinh:
      return std::asinh(x);
    case Op::acosh:
      return std::acosh(x);
    case Op::atanh:
      return std::atanh(x);
    case Op::erf:
      return std::erf(x);
    case Op::fast_inverse:
      return 1 / x;
    case Op::fast_inverse_sqrt:
      return 1 / std::sqrt(x);
    default:
      ADD_FAILURE() << ir::op_info(op).name << " has no reference: add one";
      return 0;
  }
}

// |got - exact| in ULP of the type `Number` at `exact`. Infinity counts as the number that would follow the largest
// one; it is the only right result for every exact value beyond that. NaN must be matched by NaN.
template <typename Number>
double error_in_ulp(Number got, long double exact) {
  using Limits = std::numeric_limits<Number>;
  if (std::isnan(got) || std::isnan(exact))
    return std::isnan(got) && std::isnan(exact) ? 0 : INFINITY;
  const long double beyond = std::ldexp(1.0L, Limits::max_exponent);
  const bool both_overflow = std::isinf(got) && std::fabs(exact) >= beyond;
  if (both_overflow && std::signbit(got) == std::signbit(exact)) return 0;
  const long double value =
      std::isinf(got) ? std::copysign(beyond, static_cast<long double>(got)) : got;
  int exponent = Limits::min_exponent;
  if (exact != 0 && std::isfinite(exact)) exponent = std::max(exponent, std::ilogb(exact) + 1);
  const long double ulp =
      std::ldexp(1.0L, std::min(exponent, Limits::max_exponent) - Limits::digits);
  return static_cast<double>(std::fabs(value - exact) / ulp);
}

}  // namespace retrograde

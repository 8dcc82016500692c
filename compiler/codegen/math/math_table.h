// The vector math functions: operator, name in SLEEF and limits. The largest error that we promise, over the whole
// domain and for every width, is in the operator's row (ir/operators.def); the unit test holds every function to it.
//
// Float32 pow is inlined, and so are float32 exp, log, tanh and erf on machines with FMA. All others come from SLEEF's families
// whose bits do not depend on the width, so a scalar tail agrees with the vector body. Special values follow C99 Annex F. Code compiled ahead of time for
// AArch64 calls the C library instead of SLEEF and has its errors (2 ULP with the GNU C library).
//
// Half types compute in float32 and round once more.
#pragma once

#include "ir/expr.h"

namespace retrograde::codegen {

struct MathFunction {
  ir::Op op;
  const char* stem;  // Sleef_<family>_<stem>f8_<precision>...
  const char* precision;
  // Beyond this magnitude SLEEF overflows early, and math.cpp uses another formula; 0: never.
  double float32_limit, float64_limit;
  // Largest errors of the functions that kernels use, in ULP, found by test/unit/codegen/device_math_test.cpp.
  double device_float32_ulp, device_float64_ulp;
};

inline constexpr MathFunction math_functions[] = {
    {ir::Op::exp, "exp", "u10", 0, 0, 1.1, 0.8},  // float32 with FMA: float_functions.cpp
    {ir::Op::log, "log", "u10", 0, 0, 1.3, 1.5},
    {ir::Op::pow, "pow", "u10", 0, 0, 0.6, 0.8},  // float32: float_pow.cpp
    {ir::Op::hypot, "hypot", "u05", 0, 0, 1.0, 1.2},
    {ir::Op::sin, "sin", "u10", 0, 0, 2.2, 1.5},
    {ir::Op::cos, "cos", "u10", 0, 0, 2.0, 1.5},
    {ir::Op::tan, "tan", "u10", 0, 0, 3.1, 1.1},
    {ir::Op::asin, "asin", "u10", 0, 0, 0.9, 0.9},
    {ir::Op::acos, "acos", "u10", 0, 0, 1.3, 0.9},
    {ir::Op::atan, "atan", "u10", 0, 0, 1.2, 0.8},
    {ir::Op::atan2, "atan2", "u10", 0, 0, 2.4, 1.0},
    {ir::Op::sinh, "sinh", "u10", 88.0, 709.0, 2.4, 1.9},
    {ir::Op::cosh, "cosh", "u10", 88.0, 709.0, 2.4, 1.9},
    {ir::Op::tanh, "tanh", "u10", 0, 0, 2.1, 1.1},
    {ir::Op::asinh, "asinh", "u10", 0x1p60, 0x1p500, 2.0, 1.1},
    {ir::Op::acosh, "acosh", "u10", 0x1p60, 0x1p500, 2.0, 1.5},
    {ir::Op::atanh, "atanh", "u10", 0, 0, 0.9, 0.9},
    {ir::Op::erf, "erf", "u10", 0, 0, 0.9, 0.9},
};

// The fast float32 forms, inlined. Doubles use the full-precision functions (and 1 / x, 1 / sqrt(x)).
struct FastFunction {
  ir::Op op;
  double low, high;  // the error bound holds in this domain
  double max_relative_error;
  double max_absolute_error;  // the error is within one of the two bounds
};

inline constexpr FastFunction fast_functions[] = {
    // Saturates outside the domain instead of overflowing to infinity or underflowing to 0. NaN stays NaN.
    {ir::Op::fast_exp, -87.0, 88.0, 3e-7, 0},
    // Zero gives -infinity, infinity gives infinity, negative numbers give NaN; denormals count as zero.
    {ir::Op::fast_log, 0x1p-126, 0x1.fffffep127, 3e-7, 1e-7},
    // exp(y * log(x)): the error grows with |y log(x)|; the bound holds if that is at most 8.
    {ir::Op::fast_pow, 0x1p-126, 0x1.fffffep127, 4e-6, 0},
    {ir::Op::fast_sin, -8192.0, 8192.0, 1e-6, 3e-7},
    {ir::Op::fast_cos, -8192.0, 8192.0, 1e-6, 3e-7},
    {ir::Op::fast_inverse, 0x1p-126, 0x1p126, 1e-7, 0},
    {ir::Op::fast_inverse_sqrt, 0x1p-126, 0x1.fffffep127, 4e-7, 0},
};

}  // namespace retrograde::codegen

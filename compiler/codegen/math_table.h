// The vector math functions: operator, SLEEF's name, and the largest error that we promise, in
// units in the last place of the result, over the whole domain and for every width. The unit test
// holds every row to its numbers. All but pow of float32, which is inlined, come from SLEEF's
// families whose bits do not depend on the width, so a scalar tail agrees with the vector body.
// Special values follow C99 Annex F. Code that is compiled ahead of time for AArch64 calls the C
// library instead of SLEEF; its errors are its own (2 ULP with the GNU C library).
//
// Half types compute in float32 and round once more.
#pragma once

#include "ir/expr.h"

namespace retrograde::codegen {

struct MathFunction {
  ir::Op op;
  const char* stem;  // Sleef_<family>_<stem>f8_<precision>...
  const char* precision;
  double max_ulp_float32;
  double max_ulp_float64;
  // Beyond this magnitude SLEEF overflows early, and math.cpp uses another formula; 0: never.
  double float32_limit, float64_limit;
};

inline constexpr MathFunction math_functions[] = {
    {ir::Op::exp, "exp", "u10", 1.0, 1.0, 0, 0},
    {ir::Op::log, "log", "u10", 1.0, 1.0, 0, 0},
    {ir::Op::pow, "pow", "u10", 0.55, 1.0, 0, 0},  // float32: float_pow.cpp
    {ir::Op::hypot, "hypot", "u05", 1.0, 0.6, 0, 0},  // float32: 0.6 but for denormals
    {ir::Op::sin, "sin", "u10", 1.0, 1.0, 0, 0},
    {ir::Op::cos, "cos", "u10", 1.0, 1.0, 0, 0},
    {ir::Op::tan, "tan", "u10", 1.0, 1.0, 0, 0},
    {ir::Op::asin, "asin", "u10", 1.0, 1.0, 0, 0},
    {ir::Op::acos, "acos", "u10", 1.0, 1.0, 0, 0},
    {ir::Op::atan, "atan", "u10", 1.0, 1.0, 0, 0},
    {ir::Op::atan2, "atan2", "u10", 1.0, 1.0, 0, 0},
    // Near overflow: (exp(x / 2) / 2) * exp(x / 2), 3 ULP.
    {ir::Op::sinh, "sinh", "u10", 3.0, 3.0, 88.0, 709.0},
    {ir::Op::cosh, "cosh", "u10", 3.0, 3.0, 88.0, 709.0},
    {ir::Op::tanh, "tanh", "u10", 1.1, 1.0, 0, 0},
    // Where the square overflows: log(x) + log(2), 1.5 ULP.
    {ir::Op::asinh, "asinh", "u10", 1.5, 1.5, 0x1p60, 0x1p500},
    {ir::Op::acosh, "acosh", "u10", 1.5, 1.5, 0x1p60, 0x1p500},
    {ir::Op::atanh, "atanh", "u10", 1.1, 1.0, 0, 0},
    {ir::Op::erf, "erf", "u10", 1.1, 1.0, 0, 0},
};

// The fast forms of float32, inlined. Doubles use the full functions (and 1 / x, 1 / sqrt(x)).
struct FastFunction {
  ir::Op op;
  double low, high;  // the domain in which the error holds
  double max_relative_error;
  double max_absolute_error;  // the error is within one of the two
};

inline constexpr FastFunction fast_functions[] = {
    // Saturates outside of the domain instead of overflowing to infinity or underflowing to 0. NaN
    // stays NaN.
    {ir::Op::fast_exp, -87.0, 88.0, 3e-7, 0},
    // Zero gives -infinity, infinity itself, negative numbers NaN; denormals count as zero.
    {ir::Op::fast_log, 0x1p-126, 0x1.fffffep127, 3e-7, 1e-7},
    // exp(y * log(x)): the error grows with |y log(x)|; the bound holds where that is at most 8.
    {ir::Op::fast_pow, 0x1p-126, 0x1.fffffep127, 4e-6, 0},
    {ir::Op::fast_sin, -8192.0, 8192.0, 1e-6, 3e-7},
    {ir::Op::fast_cos, -8192.0, 8192.0, 1e-6, 3e-7},
    {ir::Op::fast_inverse, 0x1p-126, 0x1p126, 1e-7, 0},
    {ir::Op::fast_inverse_sqrt, 0x1p-126, 0x1.fffffep127, 4e-7, 0},
};

}  // namespace retrograde::codegen

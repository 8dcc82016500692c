// tracked_value.h -- a scalar with a bound on the difference to other legal evaluations of the same program.
//
// The interpreter computes strictly: every operation rounds to its declared type. A compiler may contract a * b + c
// into one rounding; another may reassociate sums. Comparing results by "a few ULP" is then either too loose or wrong,
// because cancellation invalidates any ULP count. So every value carries `error`: the largest difference that the
// freedom of a Rounding model allows. Arithmetic that is exact keeps error 0 and is compared bit for bit.
//
// If the error could change a discrete decision (a comparison, a float converted to an integer), the result is
// unstable: its error is infinity, and it cannot be compared.
//
// Source: running error analysis, N. Higham, Accuracy and Stability of Numerical Algorithms, 3.3.
#pragma once

#include <limits>
#include <vector>

#include "ir/scalar.h"

namespace retrograde::oracle {

enum class Rounding {
  Strict,       // no freedom: error stays 0
  Contraction,  // a * b + c may round once, also across a cast of the product to a narrower float;
                // math functions differ as their rows say
  Reordering,   // every rounding may happen elsewhere: sums reassociated, x / c as x * (1 / c)
};

struct Value {
  ir::Scalar scalar;
  double error = 0;  // infinity: unstable. Integers and bools have 0 or infinity only

  bool is_undef() const { return scalar.type.is_handle(); }  // the value of undef()
  bool is_stable() const { return error < std::numeric_limits<double>::infinity(); }
  static Value undef() {
    Value result;
    result.scalar.type = Handle();
    return result;
  }
  static Value unstable(ir::Scalar scalar) {
    return {scalar, std::numeric_limits<double>::infinity()};
  }
};

// The distance between neighbouring numbers of a float type at x.
double ulp(Type type, double x);

// The operations of ir/scalar.h, with error bounds.
Value apply_binary(Rounding rounding, ir::Kind kind, const Value& a, const Value& b);
Value apply_not(const Value& a);
Value apply_cast(Rounding rounding, Type type, const Value& a);
Value apply_reinterpret(Type type, const Value& a);
Value apply_operator(Rounding rounding, ir::Op op, const std::vector<Value>& args, Type type);

}  // namespace retrograde::oracle

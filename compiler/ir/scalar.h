// Scalar values, and the only definition of each operation on them: the constant folder and every oracle of the tests
// use it.
#pragma once

#include <optional>
#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {

struct Scalar {
  Type type = Int(32);
  union {
    int64_t i = 0;  // Int: sign-extended
    uint64_t u;     // UInt: zero-extended (bool: 0 or 1)
    double f;       // Float, BFloat: already rounded to the type
  };
  static Scalar of_int(Type type, int64_t value);    // wraps to the type
  static Scalar of_uint(Type type, uint64_t value);  // wraps to the type
  static Scalar of_float(Type type, double value);   // rounds to the type
  static Scalar of_bool(bool value) { return of_uint(Bool(), value); }
  bool as_bool() const { return u != 0; }
  double as_double() const {
    return type.is_float() ? f : type.is_int() ? static_cast<double>(i) : static_cast<double>(u);
  }
};

double round_to_type(Type type, double value);
int64_t wrap_int(int bits, int64_t value);  // to a signed integer
// Rounds so that the remainder is never negative; division by 0 gives 0.
int64_t euclidean_div(int64_t a, int64_t b);
int64_t euclidean_mod(int64_t a, int64_t b);

// Both operands have one scalar type. Comparisons give bool.
Scalar eval_binary(Kind kind, const Scalar& a, const Scalar& b);
Scalar eval_not(const Scalar& a);
Scalar eval_cast(Type type, const Scalar& value);
Scalar eval_reinterpret(Type type, const Scalar& value);
// Evaluates Pure and Marker operators (operators.def); nullopt for Effect and Internal ones. `type`
// is the call's type. Floats narrower than 64 bits are computed in double and rounded once.
std::optional<Scalar> eval_operator(Op op, const std::vector<Scalar>& args, Type type);

std::optional<Scalar> as_scalar(const Expr& e);  // an immediate, or the lane of a Broadcast of one
Expr to_expr(const Scalar& value);

}  // namespace retrograde::ir

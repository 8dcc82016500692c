// literal.h -- converts constants to the type of the operand beside them, and rejects those that do
// not fit.
//
// An explicit cast wraps, as in C++. Where the library converts implicitly, a constant must keep
// its value: clamp(f(x), 0, 255) of an int8 must not become a clamp to -1.
#pragma once

#include <string>

#include "ir/scalar.h"

namespace retrograde::ir {

// Whether `type` can represent the value: integers exactly, floats up to the rounding of fractions.
bool holds_value(Type type, const Scalar& value);

// `e` in `type`. A constant that the type cannot represent is a CompileError: "cannot <asked>:
// <rule>; ...". Non-constant expressions are cast.
Expr literal_in(Type type, Expr e, const std::string& asked, const std::string& rule);

// The same for sizes and coordinates, which are int32.
Expr int32_literal(Expr e, const std::string& asked);

// Whether `type` can represent every value of `e`. Looks through a cast from a narrower type.
bool always_fits(Type type, const Expr& e);

// A constant as the user wrote it: 300, -0.5.
std::string literal_text(const Scalar& value);

}  // namespace retrograde::ir

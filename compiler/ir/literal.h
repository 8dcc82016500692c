// literal.h -- constants that are given the type of what stands beside them.
//
// An explicit cast wraps, as in C++. Where the library converts on its own, a constant must keep
// its value: clamp(f(x), 0, 255) of int8 means no clamp to -1.
#pragma once

#include <string>

#include "ir/scalar.h"

namespace retrograde::ir {

// Whether `type` has the value: floats up to the rounding of fractions; an integer exactly.
bool holds_value(Type type, const Scalar& value);

// `e` in `type`. CompileError when it is a constant that the type does not hold: "cannot <asked>:
// <rule>; ...". What is no constant is converted.
Expr literal_in(Type type, Expr e, const std::string& asked, const std::string& rule);

// The same for sizes and coordinates, which are int32.
Expr int32_literal(Expr e, const std::string& asked);

// Whether every value of `e` has its place in `type`. A cast from a narrower type is looked
// through.
bool always_fits(Type type, const Expr& e);

// A constant as the user wrote it: 300, -0.5.
std::string literal_text(const Scalar& value);

}  // namespace retrograde::ir

// The ends of intervals, for interval arithmetic. There are two representations. For wide signed integers ends are
// expressions in canonical linear form. For all other types they are useful only if they fold to constants, or if the
// operation keeps them unchanged.
#pragma once

#include <optional>

#include "analysis/interval.h"
#include "ir/expr.h"

namespace retrograde::analysis {

// Constant ends of any integer type, and sums and products of two of them.
using Wide = __int128;
struct WidePair {
  Wide min, max;
};
std::optional<Wide> wide_end(const Expr& end);
std::optional<WidePair> wide_ends(const Interval& v);
// A constant end; undefined when the type cannot represent it.
Expr wide_const(Type type, Wide value);
// An interval with two constant ends. An end that the type cannot represent is unbounded; a narrow type then falls back
// to its range.
Interval wide_interval(Type type, Wide min, Wide max);

// Constant ends of floats; never NaN.
std::optional<double> float_end(const Expr& end);
struct DoublePair {
  double min, max;
};
std::optional<DoublePair> float_ends(const Interval& v);  // when both are finite
// Everything if an end is NaN.
Interval without_nan(const Interval& v);

// Ends in canonical form; undefined if an operand is.
Expr end_op(Kind kind, const Expr& a, const Expr& b);
Expr negate(const Expr& e);

}  // namespace retrograde::analysis

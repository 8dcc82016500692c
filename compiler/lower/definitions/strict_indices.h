// strict_indices -- make the sums that coordinates are rounded from the same numbers everywhere, and keep NaN from making
// coordinates negative.
//
//   at = (float32(x) + 0.5f)*k - 0.5f          at = strict_float((float32(x) + 0.5f)*k - 0.5f)
//   g(int32(floor(at)))*(at - floor(at))   =>  g(int32(floor(at)))*(at - floor(at))
//
// The loops of g cover the coordinates between two ends, which are the same expression at the ends of x. If it were
// contracted to FMA in one place and not in the other, a read could be one element outside of the computed region. And
// if it were contracted in the weight of an interpolation but not in the coordinate, the two could lie on different
// sides of an integer. So the sum is strict in all stages of the program, with the variables of any Func. Sums without a
// product have nothing to contract and stay unchanged.
//
//   g(int32(abs(f(x))))   =>   g(max(int32(abs(f(x))), 0))
//
// Only NaN makes such a coordinate negative; a region that begins at 0 relies on it (analysis/nonnegative.h).
// Source: interval arithmetic needs each rounded operation to be monotone and the same on both sides (R. Moore,
// Interval Analysis, 1966). Tests: test/unit/lower/float_index_test.cpp.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

void make_indices_strict(Program& program);

}  // namespace retrograde::lower

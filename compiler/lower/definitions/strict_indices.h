// strict_indices -- make coordinates computed from floats round the same everywhere, and keep NaN from making them
// negative.
//
//   g(int32((float32(x) + 0.5f)*k - 0.5f))  =>
//   g(int32(strict_float((float32(x) + 0.5f)*k - 0.5f)))
//
// The loops of g cover the coordinates between two ends, which are the same expression at the ends of x. If it were
// contracted to FMA in one place and not in the other, a read could be one element outside of the computed region.
// Without a product and a sum there is nothing to contract, and the coordinate stays unchanged.
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

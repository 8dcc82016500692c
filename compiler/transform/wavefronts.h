// wavefronts.h -- loop skewing: recurrences along two variables of one table run several rows at once, each row behind
// the one before.
//
//   for r.y:                                  for rows:                        blocks of 16 rows
//     for r.x:                                  for front:                     r.x + slope * (row of the block)
//       d(r.x, r.y) = g(d(r.x - 1, r.y),  =>      for row in a vector:         x = front - slope * row, if that is
//                       d(r.x, r.y - 1))            d(x, 16 * rows + row)      in the domain
//
// Points on one front are independent of each other, so costly values are computed in vectors, whose lanes lie on a
// diagonal of the table; rows with cheap values are unrolled, since each hides the latency of the others.
//
// 1. The update is of a Func without directives whose loops host no other Func. It is over reduction variables only, or
//    few pure elements besides, which would fill no vector. No reduction variable can be run in parallel or in vectors
//    as it is (step_variables.h).
// 2. The two innermost reduction variables move one dimension each of the written element, by one element; the outer
//    one may instead count sweeps over the same elements.
// 3. With a slope of at most 4, every two iterations that access one element keep their order. This is proven over
//    index sets (graph/definitions/race_checks.h), so reads may be clamped, lie further away, or be in arms of selects.
//    Reads at data-dependent indices are not proven.
// 4. There are as many lines as a block has rows, and a block has at most twice as many fronts as columns, one and a
//    half times as many if rows are unrolled. Extents may be unknown.
//
// Each value is computed by the same operations from the same values: results keep their bits, but for products that are
// contracted to FMA, and functions whose vector form rounds differently.
//
// Source: L. Lamport, The parallel execution of DO loops, CACM 1974 (the wavefront method); M. Wolfe, Loop skewing,
// IJPP 1986. Not done: more than two skewed variables, such as several sweeps at once; fronts of blocks in parallel.
#pragma once

#include <vector>

#include "graph/function.h"

namespace retrograde::transform {

// Whether some Func has such an update.
bool has_wavefronts(const std::vector<FuncPtr>& outputs);
// Rewrites these updates. The graph must be the compiler's own copy, as definitions change.
void run_in_wavefronts(const std::vector<FuncPtr>& outputs);

}  // namespace retrograde::transform

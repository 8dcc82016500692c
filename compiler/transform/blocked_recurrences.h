// blocked_recurrences.h -- long linear recurrences of a few signals run in blocks: each from zeros, all at once, and then
// what the elements before a block add to it.
//
//   y(r) = x(r) + a * y(r - 1)      =>      for point, for block:      y(256 * block + point), from y(... - 1) = 0
//                                           for block:                 the last element of the block += a^256 * that
//                                                                      of the one before, which is final by then
//                                           for block, for point:      y(256 * block + point) += a^(point + 1) *
//                                                                      the last element of the block before
//
// The first and the last loop run blocks in parallel and several at once or points in vectors; of the serial chain, one
// iteration in 256 is left. What one element adds to the k-th after it, a^k here, is computed once, in Float(64); so is
// the chain of last elements, since both add their errors up over blocks.
//
// 1. The update is a linear recurrence of first or second order (linear_recurrences.h) whose Func has no directives, and
//    at most four elements in other dimensions: more signals run at once as they are.
// 2. It has 4096 iterations at least, as far as is known. The length may be unknown.
// 3. Sums of floats are reordered: adjoints are, as their other sums; the user's own Funcs only if that is allowed.
//
// An unstable recurrence overflows as it does in order, but a signal of zeros stays zero: products with what comes before
// are strong. Where the signal is infinite and a^256 rounds to 0, a later element is NaN instead of infinite.
//
// Not done: coefficients that differ from iteration to iteration; higher orders; GPUs.
// Source: P. Kogge and H. Stone, A parallel algorithm for the efficient solution of a general class of recurrence
// equations, IEEE Trans. Computers 1973, for the split; G. Chaurasia et al., Compiling high performance recursive
// filters, HPG 2015, for blocks with a carried state.
#pragma once

#include <vector>

#include "graph/function.h"
#include "transform/factored_graph.h"

namespace retrograde::transform {

// Whether some Func has such an update.
bool has_blocked_recurrences(const std::vector<FuncPtr>& outputs, SumOrder order);
// Rewrites these updates. The graph must be the compiler's own copy, as definitions change.
void run_in_blocks(const std::vector<FuncPtr>& outputs, SumOrder order);

}  // namespace retrograde::transform

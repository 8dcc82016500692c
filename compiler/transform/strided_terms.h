// strided_terms.h -- sums whose terms are 0 unless an index is a multiple of a stride, as in a transposed convolution,
// add the other terms only.
//
//   spread(x) = select(x % 2 == 0, in(x / 2), 0)         f(x) = bias + left_out((x + 1) % 2)
//   f(x) = bias                                     =>   f(x) += in((x + 1) / 2 - q) * w((x + 1) % 2 + 2 * q)     q < 2
//   f(x) += spread(x + 1 - r) * w(r)        r < 4
//                                                        left_out(p) = -0
//                                                        left_out(p) += select(r % 2 == p, -0, 0 * w(r))          r < 4
//
// Each result has the same bits as before, except that all NaNs are alike and that other products may be contracted to
// FMA. The terms that are left out are 0 * w(r): a zero where w is finite, else NaN. Their sum has one element for each
// phase of the stride, and not one for each x. A sum of zeros may be added before the other terms, which keep their
// order. Adding -0 changes no number, not even the sign of a zero.
//
// Method: the condition (s * r + rest) % m == k, where s is 1 or -1, holds for every m-th r from the first one, which
//         the pure variables decide. Quotients of s * r + rest become the number of the term plus a quotient without r.
// Not done: strides in RDom::where; products with a factor that moves along the rows of the result, since there are as
//           many zeros as elements; scheduled Funcs, and loops that other Funcs are computed in.
// Source: polyphase decomposition (Vaidyanathan, Multirate Systems and Filter Banks, 1993, chapter 4).
#pragma once

#include <vector>

#include "graph/function.h"

namespace retrograde::transform {

// Whether some Func has such a sum.
bool has_strided_terms(const std::vector<FuncPtr>& outputs);
// Rewrites these sums. The graph must be the compiler's own copy, as definitions change.
void leave_out_zero_terms(const std::vector<FuncPtr>& outputs);

}  // namespace retrograde::transform

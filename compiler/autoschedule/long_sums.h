// long_sums.h -- adds the terms of long float32 sums in blocks, each in registers of its own.
//
//   sum(x) += term(x, r)     =>     for x, in lanes: for o: block(x, o) += term(x, 64 o + i)   over i
//                                                           sum(x) += block(x, o)
//
// A chain of n additions is wrong by up to n * 2^-24 of the sum of absolute values. A block ends its chain after 64 to
// 256 terms, about as many as there are blocks. The sum of 131,072 equal terms along rows (columns) is wrong by 8e-7
// (4e-6) of itself instead of 1e-3. The cut depends on the program alone.
#pragma once

#include <cstdint>
#include <vector>

#include "autoschedule/machine/reference.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Terms of a lane from which blocks pay. Where lanes along rows, each of which adds a part of the terms, would be the
// alternative, blocks are needed to be as exact.
inline constexpr auto long_chain = static_cast<int64_t>(planning::longest_chain);
inline constexpr int64_t long_chain_instead_of_rows = 128;

// Whether the update adds numbers that are rounded to less than double, and a lane adds more of them than `most`.
// `loops`: of the reduction, innermost first; the first is in vectors of so many lanes (1: none).
bool is_long_sum(const FuncContents& f, const Definition& update,
                 const std::vector<ReductionVariable>& loops, int lanes = 1,
                 int64_t most = long_chain);

// Cuts the loops of such a sum, which have their final order, so that a lane adds few terms in those that stay inside.
// Blocks become a Func (rfactor.h), which is returned, is computed in the loops of f and takes the vectors of its
// update. Tasks are made later.
FuncPtr add_in_blocks(const FuncPtr& f, int index, const std::vector<ReductionVariable>& loops,
                      int lanes);

}  // namespace retrograde::autoschedule

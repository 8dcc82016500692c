// blocked_sums.h -- splits long sums of float32 terms into blocks: float32 within a block, double across blocks.
//
//   sum(x) += double(term(x, r))   over r   =>   block(x, o) += term(x, o * 32 + i)    over i
//                                                 sum(x) += double(block(x, o))         over o
//
// Accuracy: a block adds at most n = 32 terms in float32 (16 if the sum is short). It is wrong by at most n * 2^-24 =
// 2e-6 of the sum of their absolute values; in practice by half of that for equal terms and by a tenth for varied
// terms. A block overflows where the sum of its terms does.
//
// Cost: adding each term in double takes two conversions and two additions of half a vector; adding it to a block takes
// one fused multiply-add. The work for each block, with its test for NaN, takes as long as 10 products. Blocks of 64
// terms would save another tenth of the time of a convolution's gradient by its weights, but lose up to 2e-6 of small
// terms beside a large one.
//
// Factors of a term that no loop inside of a block moves are left to its sum: block(c, o) += strong_mul(adj(...), s(c))
// becomes a sum of adj(...), of which the reader takes strong_mul(block(c, o), s(c)). Only the outermost factors: the
// terms themselves are rounded, and overflow, as before.
//
// Loops of unknown extent may be short. They are not split; blocks are taken from the other loops.
//
// Source: the error of blocked summation is that of its blocks (Higham, The Accuracy of Floating Point Summation, SIAM
// J. Sci. Comput. 14, 1993, section 3).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::autodiff {

// Rounds a long constant extent up to whole blocks, because indices are simpler without a remainder.
Expr in_whole_blocks(const Expr& extent);

struct SumOfBlocks {
  FuncPtr block;
  std::vector<ReductionVariable> rvars;  // loops over blocks
  std::vector<Expr> values;              // reads of the block, one for each term
};

// `point` has the pure variables of the elements. `terms`, at least one of which is defined, and the predicate are in
// terms of these and `rvars`. The block's Func is named after `name`. Returns nullopt if one block could hold all
// terms, or if there is no loop to split.
std::optional<SumOfBlocks> sum_in_blocks(const std::string& name, const std::string& of,
                                         const std::vector<Expr>& point,
                                         const std::vector<ReductionVariable>& rvars,
                                         const std::vector<Expr>& terms, const Expr& predicate);

}  // namespace retrograde::autodiff

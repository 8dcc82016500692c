// blocked_sums.h -- long sums of float32 terms by blocks.
//
//   sum(x) += double(term(x, r))   over r   =>   block(x, o) += term(x, o * 32 + i)    over i
//                                                sum(x) += double(block(x, o))         over o
//
// A block adds at most n = 32 terms in float32, 16 where the sum is short, so it is wrong by at most
// n * 2^-24, 2e-6, of the sum of their absolute values: by half of that where all are alike, by a tenth
// where they are not. Blocks are added in double. Adding each term in double would take two conversions
// and two additions of half a vector where a block takes one multiplication with addition. What is done
// once for a block, those and the look for NaN, takes as long as 10 products: of 64 terms a block would
// save another tenth of the time of a convolution's gradient by its weights, and small terms beside a
// large one lose 2e-6. A block overflows where the sum of its terms does. Loops of unknown extent, which
// may be short, are left whole: blocks are cut from the others.
// Source: the error of blocked summation is that of its blocks (Higham, The Accuracy of Floating
// Point Summation, SIAM J. Sci. Comput. 14, 1993, section 3).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::autodiff {

// A long known extent rounded up to whole blocks: places in it are simpler than with a rest.
Expr in_whole_blocks(const Expr& extent);

struct SumOfBlocks {
  FuncPtr block;
  std::vector<ReductionVariable> rvars;  // over blocks
  std::vector<Expr> values;              // of the block there, one a term
};

// `point`: the pure variables of the elements. `terms`, at least one of which is defined, and the
// predicate are over these and `rvars`. nullopt: there are no more terms than one block has, or no
// loop to make a block of. The block's Func is named after `name`.
std::optional<SumOfBlocks> sum_in_blocks(const std::string& name, const std::string& of,
                                         const std::vector<Expr>& point,
                                         const std::vector<ReductionVariable>& rvars,
                                         const std::vector<Expr>& terms, const Expr& predicate);

}  // namespace retrograde::autodiff

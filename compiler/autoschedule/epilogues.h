// epilogues.h -- what a sum gives to one pure Func alone, at the same place, stays in registers until that
// Func has used it: each tile of sums is computed in the loops of the Func.
//
//   convolved(x, y, c) += ...;  result(x, y, c) = max(convolved(x, y, c), 0)
//
//   for tiles: convolved += ...            for tiles:
//   for c, y, x: result = ...       =>       convolved += ...
//                                            result = ...
//
// The Func takes the loops over tiles, and what they host, such as the rows that tiles read copied. The
// other way, windows of rows (strips.h), is better for stencils that read what is computed, too, and for
// sums of few terms behind which a chain of stencils goes on.
// Source: the epilogues of matrix products (CUTLASS), which a tile passes on its way to memory.
#pragma once

#include <functional>
#include <unordered_set>
#include <vector>

#include "autoschedule/only_reader.h"
#include "autoschedule/register_tile.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Gives a sum, whatever loops it has, those of one tile of it.
using GiveLoopsOfTile = std::function<void(const FuncPtr& sum, const RegisterTile& tile)>;

// Of `given`, which this scheduler has computed at root and given loops. `readers`: before that, as what a
// sum's loops host moves with it. `but`: none of these. `lanes`: of the vectors. The result: sums and
// their readers, whose loops belong together from then on.
std::vector<FuncPtr> compute_epilogues(const std::vector<FuncPtr>& outputs, const Readers& readers,
                                       const std::vector<FuncPtr>& given,
                                       const std::unordered_set<const Symbol*>& but, int lanes,
                                       const GiveLoopsOfTile& give_loops);

}  // namespace retrograde::autoschedule

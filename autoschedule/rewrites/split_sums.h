// split_sums.h -- reductions in parts, whose partial results are Funcs.
//
//   loss() += e(r.x, r.y)          rows(lane, row) += e(16 t + lane, row)         a few elements: lanes and rows
//                                  groups(lane, group) += rows(lane, 32 s + group)
//                                  loss() += groups(lane, group)
//   bins(hist(r.x, r.y)) += 1      parts(i, part) += 1, at i = hist(r.x, 32 s + part)     data-dependent indices
//                                  bins(i) += parts(i, part)
//   mean(y) += f(r, y)             block(y, o) += f(256 o + i, y)                  many elements: blocks of terms
//                                  mean(y) += block(y, o)
//
// A reduction to few elements has no loop that runs in vectors or in parallel, and neither has a sum at data-dependent
// indices. A chain of n additions in float32 is wrong by up to n * 2^-24 of the sum of absolute values, so none is longer
// than machine/reference.h says. How a sum is split depends on the program alone.
#pragma once

#include <vector>

#include "autoschedule/access/access_graph.h"
#include "ir/visit.h"

namespace retrograde::planning {

// Splits updates of the Funcs of this graph that may change. Adjoints have their own partial sums and blocks, only
// long adjoint sums to a few elements are split here. `accesses`: of the program or one like it; afterwards, of the program
// before its sums were split.
void split_sums(const std::vector<graph::FuncPtr>& outputs,
                ir::FunctionRef<bool(const graph::FuncContents&)> may_change,
                AccessGraph& accesses);

}  // namespace retrograde::planning

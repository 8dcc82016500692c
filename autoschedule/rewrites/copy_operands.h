// copy_operands.h -- copies of what contractions read.
//
//   mixed(x, y, c) += weight(k, c) * inner(x, y, k)     =>     inner_in_mixed(x, y, k) = inner(x, y, k)
//
// A tile of such sums reads a piece of an operand again and again: across its rows, through a boundary condition, or in
// the wrong order for its lanes. A plan may compute the copy for a tile, for many of them or all at once, with its
// dimensions in another order.
// Method: K. Goto and R. van de Geijn, Anatomy of High-Performance Matrix Multiplication, ACM TOMS 34 (2008), section 4.
#pragma once

#include <vector>

#include "autoschedule/access/access_graph.h"
#include "ir/visit.h"

namespace retrograde::planning {

// Gives wrappers to Funcs and images of this graph, for consumers that may change, each of its own: where sums of more than
// a small part of the program's work read each element several times. `accesses`: of the program or one like it; afterwards,
// of the program without copies.
void copy_operands(const std::vector<graph::FuncPtr>& outputs,
                   ir::FunctionRef<bool(const graph::FuncContents&)> may_change,
                   AccessGraph& accesses);

}  // namespace retrograde::planning

// graph_rewrites.h -- the forms of definitions that no schedule can give, made before a graph is scheduled: costly
// factors become Funcs (invariant_factors.h), zeros between elements are left out (strided_terms.h), long recurrences run
// in blocks (blocked_recurrences.h), and recurrences along two variables are skewed (wavefronts.h).
#pragma once

#include <vector>

#include "graph/function.h"
#include "transform/factored_graph.h"

namespace retrograde::transform {

// Whether an adjoint is among the Funcs.
bool is_differentiated(const std::vector<FuncPtr>& outputs);

// The outputs of a graph with these forms. `outputs`, whose wrappers have been applied, and its Funcs stay as they are;
// the new graph shares those that are alike. On a GPU, nothing is skewed
// or runs in blocks.
std::vector<FuncPtr> with_graph_rewrites(const std::vector<FuncPtr>& outputs, bool on_gpu,
                                         SumOrder order = SumOrder::Kept);

}  // namespace retrograde::transform

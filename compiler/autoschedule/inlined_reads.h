// inlined_reads.h -- what a stage reads of what is stored, through the Funcs that are computed inline.
#pragma once

#include <vector>

#include "graph/function.h"

namespace retrograde::autoschedule {

// Whether readers of f compute it themselves. `stored`: those that will be at root, whether they are
// scheduled yet or not.
bool is_computed_inline(const FuncPtr& f, const std::vector<FuncPtr>& stored);

// The places, the condition and the values of a stage with the calls of Funcs that are computed
// inline replaced by their values, without lets; of many such calls the first ones only.
std::vector<Expr> roots_with_inlined(const Definition& stage,
                                     const std::vector<FuncPtr>& stored = {});

}  // namespace retrograde::autoschedule

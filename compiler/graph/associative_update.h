// associative_update.h -- what an update definition does to an element, as an operator on elements.
#pragma once

#include "analysis/associativity.h"
#include "graph/function.h"

namespace retrograde::graph {

// The update as f(x) = op(f(x), e): its references to f are all to the point that it writes, and op
// is proven associative.
AssociativityProof prove_associative(const FuncContents& f, const Definition& update);

}  // namespace retrograde::graph

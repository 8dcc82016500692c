// associative_update.h -- recognises update definitions that apply an associative operator.
#pragma once

#include "analysis/associativity.h"
#include "graph/function.h"

namespace retrograde::graph {

// Writes the update as f(x) = op(f(x), e). The proof holds when the update references f only at the
// point that it writes, and op is proven associative.
AssociativityProof prove_associative(const FuncContents& f, const Definition& update);

}  // namespace retrograde::graph

// plain_reduction.h -- updates that may run in vectors of terms.
//
//   sum(x) = sum(x) + a(r, x) - b(r, x)     a plain reduction
//   sum(x) = sum(x) * 0.5f + a(r, x)        none: the terms of an element have an order
//   bins(hist(r)) = bins(hist(r)) + 1       none: each term has an element of its own
#pragma once

#include "graph/function.h"

namespace retrograde::planning {

// Whether the update adds terms to one element, multiplies it by them, or takes their minimum or maximum, which is what
// lowering combines lanes for (compiler/lower/vectors/vector_stores.h). Terms read nothing of the Func. Each value of a
// Tuple has terms of its own.
bool is_plain_reduction(const graph::FuncContents& f, const graph::Definition& update);

}  // namespace retrograde::planning

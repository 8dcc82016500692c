// cost_estimate.h -- operations of a value: for counting them, and for Funcs that are made only where they pay.
#pragma once

#include <vector>

#include "graph/function.h"
#include "ir/expr.h"
#include "ir/visit.h"

namespace retrograde::transform {

// Operations up to which a value is recomputed rather than stored.
inline constexpr double cheap = 6;

// The work of a node, without its operands; what operators take is in their table
// (ir/operators.def). Integers are indices and borders, mostly simplified away: only where floats
// take part is there work.
Work work_of(const Expr& node);
// The same in operations of a vectorized loop: a read is one, a function as many additions as it takes
// as long as, and a division four more than a multiplication; multiplications come with an addition
// each, and comparisons with the choice that they decide.
double operations_of(const Expr& node);
// The operations of all nodes of the values, each node once; a call of a Func or of an image has those that
// `of_call` says, beside its indices. Integer values are work, too: a vector holds more of narrow ones.
double operations_of_values(const std::vector<Expr>& values,
                            FunctionRef<double(const Call&)> of_call);
// The iterations of its reduction domain: the terms of a sum for an element. Loops of unknown extent have `of_unknown`.
double terms_of(const Definition& stage, double of_unknown);

}  // namespace retrograde::transform

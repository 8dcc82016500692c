// race_checks.h -- decides which loops over reduction variables may be reordered or run
// concurrently.
#pragma once

#include <string>

#include "graph/function.h"

namespace retrograde::graph {

// Whether iterations of `rvar` access different elements, so that they may run concurrently: no
// iteration writes what an iteration with another value of `rvar` reads or writes, for any values
// of the other variables (analysis/never_meet.h). False means unknown.
bool can_prove_race_free(const FuncContents& f, const Definition& update, const std::string& rvar);

// Whether all points of the update commute: it is f(same point) op e with an operator that is
// proven associative and commutative, for ties too. Floats are included, although reordering
// changes the rounding of their sums. False means unknown.
bool can_prove_commutative(const FuncContents& f, const Definition& update);

// Whether the update stores the same value at every point and does not read its Func, so that
// conflicting stores agree. False means unknown.
bool stores_one_value(const FuncContents& f, const Definition& update);

// A read of the Func by its update at a point that is not proven to be the written one, or one that
// the update never writes; undefined when there is none.
Expr read_of_other_element(const FuncContents& f, const Definition& update);

}  // namespace retrograde::graph

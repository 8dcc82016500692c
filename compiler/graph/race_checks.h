// race_checks.h -- which loops over reduction variables may run in another order, or at the same time.
#pragma once

#include <string>

#include "graph/function.h"

namespace retrograde::graph {

// Whether iterations of `rvar` touch different elements: no iteration writes what another one, with
// another value of `rvar`, reads or writes, whatever the values of the other variables are
// (analysis/never_meet.h). Then they may run at the same time. False means unknown.
bool can_prove_race_free(const FuncContents& f, const Definition& update, const std::string& rvar);

// Whether all points of the update commute: it is f(same point) op e with an operator that is
// proven associative and commutative, for ties too. Floats count: their sums change by rounding
// only. False means unknown.
bool can_prove_commutative(const FuncContents& f, const Definition& update);

// Whether the update stores one value wherever it goes and reads nothing of its Func: two points
// that meet store the same. False means unknown.
bool stores_one_value(const FuncContents& f, const Definition& update);

// A read of the Func by its update at a point that is not proven to be the one written, or one that
// the update never writes; undefined when there is none.
Expr read_of_other_element(const FuncContents& f, const Definition& update);

}  // namespace retrograde::graph

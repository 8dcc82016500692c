// turned_loops.h -- the loops of sums in vectors along a dimension that is not their first (turned_sums.h).
#pragma once

#include <vector>

#include "autoschedule/turned_sums.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Loops of the stages of the block, which is computed in loops of `sums`, and of the update of `sums`, which adds blocks in
// double. `between`: loops that stand just inside of those of the reduction. Returns the loops over tiles.
std::vector<VarOrRVar> give_turned_loops(const FuncPtr& sums, const FuncPtr& block,
                                         const TurnedSum& turned, const std::vector<Var>& between,
                                         int lanes);

// Loops of a Func that adds up all terms in its only update, whose loops over terms are given, innermost first. Returns the
// loops over tiles.
std::vector<VarOrRVar> give_turned_loops(const FuncPtr& sums, const TurnedSum& turned,
                                         const std::vector<RVar>& terms, int lanes);

// Loops of an update that adds these sums, whose rows lie along the dimension.
void add_turned_sums(const FuncPtr& f, int index, size_t dimension, int lanes);

// Loops of an update that adds lanes of such sums, along the rows that these have; false: it adds something else.
bool add_turned_lanes(const FuncPtr& f, int index, int lanes);

}  // namespace retrograde::autoschedule

// iteration_order.h -- rules for directives that reorder the iterations of a stage or run them
// concurrently. Each check throws CompileError, which quotes `asked`.
#pragma once

#include <string>
#include <vector>

#include "graph/directives/give_directive.h"

namespace retrograde::graph {

// Reduction loops keep their order unless the update is proven to commute, or all iterations that access one
// element are proven to keep theirs: loops inside of a loop over steps may move freely among each other.
// Loops that run concurrently must be allowed to do so in the new order, too. `dims`: the loops in that order.
void check_reduction_order(const SchedulePlace& at, const std::vector<Dim>& dims,
                           const std::string& asked);

// Iterations of a loop that may access the same element, at one point of the loops around it, need one of
// these: an associative and commutative update with atomic(), an update that always stores the same value,
// atomic(true), or allow_race_conditions(). Vector lanes under atomic(true) run one after the other, so they
// may read each other's elements.
void check_race_free(const SchedulePlace& at, const std::string& loop, ForType runs,
                     const std::string& asked);

// If one of the loops is parallel or vectorized, the fused loop would run iterations of both
// concurrently. Making it serial would not be what the user asked for. `inner`, `outer`: their places.
void check_fused_race(const SchedulePlace& at, size_t inner, size_t outer,
                      const std::string& asked);

}  // namespace retrograde::graph

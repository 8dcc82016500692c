// iteration_order.h -- rules for directives that reorder the iterations of a stage or run them
// concurrently. Each check throws CompileError, which quotes `asked`.
#pragma once

#include <string>
#include <vector>

#include "graph/directives/give_directive.h"

namespace retrograde::graph {

// Reduction loops keep their order unless the update is proven to commute. Loops whose iterations
// access different elements may move freely. `dims`: the loops in their new order.
void check_reduction_order(const SchedulePlace& at, const std::vector<Dim>& dims,
                           const std::string& asked);

// Iterations that may access the same element need one of these: an associative and commutative
// update with atomic(), an update that always stores the same value, atomic(true), or
// allow_race_conditions(). Vector lanes under atomic(true) run one after the other, so they may
// read each other's elements. `otherwise` is the advice in the message; empty: to choose a pure
// loop.
void check_race_free(const SchedulePlace& at, const std::string& loop, bool is_vectorized,
                     const std::string& asked, const std::string& otherwise = {});

// If one of the loops is parallel or vectorized, the fused loop would run iterations of both
// concurrently. Making it serial would not be what the user asked for.
void check_fused_race(const SchedulePlace& at, const Dim& inner, const Dim& outer,
                      const std::string& asked);

}  // namespace retrograde::graph

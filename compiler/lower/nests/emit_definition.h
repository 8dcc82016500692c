// emit_definition -- build the innermost statement of a stage, and find the regions that it accesses.
//
//   f(x) = select(p, a * a, 0), a = g(x) + 1      let t = g(f.s0.x) + 1
//                                            =>   f(f.s0.x) = select(p, t * t, 0)
//
// Shared sub-expressions become lets, so that expressions are trees from here on, of the same size as the DAG.
#pragma once

#include <string>

#include "lower/nests/build_loop_nests.h"
#include "lower/nests/stage_nest.h"

namespace retrograde::lower {

// if (guards && predicate) { lets; Provide }. For an update of several points at once, the lets hold all values read
// of f, and a Provide follows for each point.
Stmt emit_definition(const LoopedFunc& f, int stage, const StageNest& nest);

// The boxes that one point of the loops reads of other Funcs, images and (in updates) of f, and the box that it writes
// of f. `values`: bounds of the values of Funcs that are used as coordinates.
Requirements requirements_of(const LoopedFunc& f, int stage, const StageNest& nest,
                             const ValueBounds& values);

// The box of its own Func that an update reads and writes at the points of its domain; nullopt if none.
std::optional<Box> own_elements(const LoopedFunc& f, int stage, const Domain& domain,
                                const ValueBounds& values);

// Whether garbage in the values that a first definition reads is harmless as long as its results are unused: they are
// not used as unclamped coordinates and have no effects.
bool tolerates_any_values(const Definition& definition, const ValueBounds& values);
// The boxes that a first definition reads at the points of its domain.
Requirements read_inside(const LoopedFunc& f, const Domain& domain, const ValueBounds& values);

// Whether the same analysis shows that the predicate holds nowhere; the regions that the stage reads are then not
// computed.
bool never_stores(const LoopedFunc& f, int stage, const Requirements& uses);

}  // namespace retrograde::lower

// emit_definition -- the innermost statement of a stage, and what it reads.
//
//   f(x) = select(p, a * a, 0), a = g(x) + 1      let t = g(f.s0.x) + 1
//                                            =>   f(f.s0.x) = select(p, t * t, 0)
//
// Shared sub-expressions become lets, so that from here on expressions are trees whose size is that
// of the DAG.
#pragma once

#include <string>

#include "lower/nests/build_loop_nests.h"
#include "lower/nests/stage_nest.h"

namespace retrograde::lower {

// if (guards && predicate) { lets; Provide }. Of an update at several points at once the lets hold
// all that is read of f, and a Provide follows for each point.
Stmt emit_definition(const LoopedFunc& f, int stage, const StageNest& nest);

// Boxes that one point of the loops reads of other Funcs, images and (in updates) of f, and that it
// writes of f. `values`: between what values Funcs lie, for those that are coordinates here.
Requirements requirements_of(const LoopedFunc& f, int stage, const StageNest& nest,
                             const ValueBounds& values);

// Whether any values may stand for those that a first definition reads, as far as its own do not
// count: they are no coordinates, unless clamped, and have no effects.
bool takes_any_values(const Definition& definition, const ValueBounds& values);
// What a first definition reads at the points of its domain.
Requirements read_inside(const LoopedFunc& f, const Domain& domain, const ValueBounds& values);

// Whether no point passes the predicate, by the same analysis: what the stage reads is then not
// computed anywhere.
bool never_stores(const LoopedFunc& f, int stage, const Requirements& uses);

}  // namespace retrograde::lower

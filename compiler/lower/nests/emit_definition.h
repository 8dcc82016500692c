// emit_definition -- the innermost statement of a stage, and what it reads.
//
//   f(x) = select(p, a * a, 0), a = g(x) + 1      let t = g(f.s0.x) + 1
//                                            =>   f(f.s0.x) = select(p, t * t, 0)
//
// Shared sub-expressions become lets, so that from here on expressions are trees whose size is that
// of the DAG.
#pragma once

#include <set>
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

// The Funcs among `uses` of which a stage may read any values beyond its domain, where its loops
// round up: what it computes there does not count. None where values are places, or have effects.
std::set<std::string> funcs_read_rounded(const LoopedFunc& f, int stage, const StageNest& nest,
                                         const Requirements& uses);
// What a stage reads of a Func at the points of its domain.
Box read_inside(const LoopedFunc& f, int stage, const Domain& domain, const ValueBounds& values,
                const std::string& func);

// Whether no point passes the predicate, by the same analysis: what the stage reads is then not
// computed anywhere.
bool never_stores(const LoopedFunc& f, int stage, const Requirements& uses);

}  // namespace retrograde::lower

// nest_checks.h -- checks of schedules that need the loop nests, with their error messages.
#pragma once

#include "lower/nests/build_loop_nests.h"
#include "lower/nests/stage_nest.h"

namespace retrograde::lower {

// The quoted names of the Funcs whose definitions read f, for messages.
std::string consumers_of(const Program& program, const LoopedFunc& f);

void check_bounded(const Program& program, const LoopedFunc& f, const Box& box);
// `stored`: a Func that is computed inside `loop` of f and stored outside of it.
void check_no_shared_storage(const LoopedFunc& f, const Loop& loop, const std::string& stored);
// Reports a Func that is neither computed nor stored anywhere when the walk arrives at the root.
void check_found_its_place(const Program& program, const LoopedFunc& f, bool is_stored);
// Check that hoisted storage has a loop, and that its size is bounded.
void check_place_found(const Program& program, const LoopedFunc& f);
void check_room(const LoopedFunc& f, const Box& room);
void check_storage_of_output(const LoopedFunc& f);

// Checks at run time.
Stmt bound_check(const LoopedFunc& f, int d, const Interval& required, const Interval& promised);
Stmt fold_check(const LoopedFunc& f, int d, const Expr& touched, const Expr& factor);
Stmt storage_check(const LoopedFunc& f, int d, const Expr& needed, const Expr& promised);

}  // namespace retrograde::lower

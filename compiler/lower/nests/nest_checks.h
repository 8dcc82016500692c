// nest_checks.h -- what a schedule must obey that only building the loops tells, and the messages
// when it does not.
#pragma once

#include "lower/nests/build_loop_nests.h"
#include "lower/nests/stage_nest.h"

namespace retrograde::lower {

// Funcs whose definitions read f, quoted, for messages.
std::string consumers_of(const Program& program, const LoopedFunc& f);

void check_bounded(const Program& program, const LoopedFunc& f, const Box& box);
// `stored`: a Func that is computed inside `loop` of f and stored outside of it.
void check_no_shared_storage(const LoopedFunc& f, const Loop& loop, const std::string& stored);
// What was neither computed nor stored when the walk came to the root.
void check_found_its_place(const Program& program, const LoopedFunc& f, bool is_stored);
// A place for hoisted storage that no loop gave, and one that nothing bounds.
void check_place_found(const Program& program, const LoopedFunc& f);
void check_room(const LoopedFunc& f, const Box& room);
void check_storage_of_output(const LoopedFunc& f);

// Checks at run time.
Stmt bound_check(const LoopedFunc& f, int d, const Interval& required, const Interval& promised);
Stmt fold_check(const LoopedFunc& f, int d, const Expr& touched, const Expr& factor);
Stmt storage_check(const LoopedFunc& f, int d, const Expr& needed, const Expr& promised);

}  // namespace retrograde::lower

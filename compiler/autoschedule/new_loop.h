// new_loop.h -- names of loops that a schedule makes: such as a user would give, so that the log
// reads well, and the same for each build of a program.
#pragma once

#include <string>

#include "frontend/schedule/stage.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// `wanted`, with more behind it where that is a loop of the stage or a variable of the Func.
std::string new_loop(const FuncContents& f, int stage, std::string wanted);
// The same for what is inside of a loop that is split: xi for x, and for r$4.x.
std::string inner_loop(const FuncContents& f, int stage, const std::string& split);
// stage.vectorize(loop, lanes, tail), where the new loop is called so.
void vectorize(Stage stage, const VarOrRVar& loop, int lanes, TailStrategy tail);

// Of all stages of f: what runs inside of tasks is no set of tasks of its own.
void run_serially(const FuncPtr& f);

}  // namespace retrograde::autoschedule

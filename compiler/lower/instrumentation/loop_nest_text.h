// The loop nest of a pipeline as a user schedules it: one line a loop, producers marked.
//
// What constants the ends of loops are, and which loops run once, is found through the names of
// regions (build_loop_nests.h), in time about linear in the number of names.
#pragma once

#include <string>

#include "lower/program.h"

namespace retrograde::lower {

std::string loop_nest_text(const Program& program);

}  // namespace retrograde::lower

// Prints the loop nest of a pipeline for print_loop_nest: one line per loop, with producers and consumers marked.
//
// The names of regions (build_loop_nests.h) show which loop bounds are constant and which loops run once. The time is
// about linear in the number of names.
#pragma once

#include <string>

#include "lower/program.h"

namespace retrograde::lower {

std::string loop_nest_text(const Program& program);

}  // namespace retrograde::lower

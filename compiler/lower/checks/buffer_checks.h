// buffer_checks.h -- the checks of a buffer before a generated function runs.
//
// Two calls of the runtime make them (runtime/buffer.cpp), because inline checks took longer to compile than a small
// kernel. Asserts that generate no code tell the simplifier what these calls guarantee.
#pragma once

#include <vector>

#include "analysis/interval.h"
#include "lower/checks/shape_facts.h"

namespace retrograde::lower {

// Checks that there is a buffer, its element type, its dimensions and its extents. It comes before the facts.
void add_shape_check(const LoweredArgument& arg, std::vector<Stmt>& checks);
// States what that check guarantees.
void add_extent_facts(const LoweredArgument& arg, std::vector<Stmt>& checks);

// Checks the memory, the density and the region of the buffer; an empty box is compared by its numbers. If the region is
// promised, the promise must contain it instead. `has_device`: data may be in device memory only.
void add_region_checks(const LoweredArgument& arg, const Box& used, bool has_device,
                       std::vector<Stmt>& checks);

// Whether the statement is one of the two calls, which return from the function if the check fails.
bool is_check_by_runtime(const Stmt& s);

}  // namespace retrograde::lower

// promise_checks.h -- checks that what users promise about buffers is large enough and true.
#pragma once

#include <vector>

#include "analysis/interval.h"
#include "lower/checks/shape_facts.h"

namespace retrograde::lower {

// Checks that a promised region contains the used one, which can be done before looking at the buffer.
void add_promise_checks(const LoweredArgument& arg, const Box& used, const ShapeFacts& facts,
                        std::vector<Stmt>& checks);

// Checks that the buffer has the promised shape.
void add_constraint_checks(const LoweredArgument& arg, const ShapeFacts& facts,
                           std::vector<Stmt>& checks);

}  // namespace retrograde::lower

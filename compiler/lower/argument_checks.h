// argument_checks -- what a generated function checks of its arguments before it runs, and how it
// answers a bounds query.
//
// In:  the loop nests, with the boxes they read of inputs and touch of outputs.
// Out: the same inside the checks. In this order: buffers are not null, have the element type and
//      dimensions, sane extents; scalars are in their range; then, when any buffer is a query (host
//      null), every query gets the box that it must have and the function returns; else every
//      constraint (strides, promised bounds) holds; when every output is empty the function returns;
//      and every box lies inside its buffer. Messages name the buffer, the dimension and both boxes.
#pragma once

#include "ir/lowered_function.h"
#include "lower/build_loop_nests.h"

namespace retrograde::ir {

Stmt add_argument_checks(const LoopNests& nests, const std::vector<LoweredArgument>& args,
                         const Program& program);

}  // namespace retrograde::ir

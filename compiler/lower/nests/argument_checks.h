// argument_checks -- what a generated function checks of its arguments before it runs, and how it
// answers a bounds query.
//
// In:  the loop nests, with the boxes they read of inputs and touch of outputs.
// Out: the same inside the checks. In this order: buffers are not null, have the element type and
//      dimensions, sane extents; scalars are in their range; then, when any buffer is a query (host
//      null), every query gets the box that it must have and the function returns; else every
//      promise (strides, bounds) holds; when every output is empty the function returns; and every
//      buffer has memory, is dense and has its box. Messages name the buffer, the dimension and both
//      boxes.
//
// What is checked of every buffer is two calls of the runtime (runtime/buffer.cpp): as code of its
// own it took longer to compile than a small kernel. The simplifier still learns what they make
// sure of, from Asserts that are no code.
#pragma once

#include "ir/lowered_function.h"
#include "lower/nests/build_loop_nests.h"

namespace retrograde::lower {

// `has_device`: data may lie on a device alone.
Stmt add_argument_checks(const LoopNests& nests, const std::vector<LoweredArgument>& args,
                         const Program& program, bool has_device);

// Whether the statement does nothing but ask the runtime for such a check and leave when it fails.
bool is_check_by_runtime(const Stmt& s);

}  // namespace retrograde::lower

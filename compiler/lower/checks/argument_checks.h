// argument_checks -- check the arguments of a generated function before it runs, and answer bounds queries.
//
// In:  Nests: the loops, with the regions that they read of inputs and access of outputs (root_statement.h).
// Out: Nests: the loops inside the checks, in this order:
//      - buffers are not null and have the right element type, dimensions and sane extents; scalars are in range;
//      - if any buffer is a bounds query (null host pointer), every query receives its required box and the function
//        returns;
//      - every promise (strides, bounds) holds;
//      - if every output is empty, the function returns;
//      - every buffer has memory, is dense and contains its required box.
//      Messages name the buffer, the dimension and both boxes.
#pragma once

#include "ir/lowered_function.h"
#include "lower/program.h"

namespace retrograde::lower {

// `has_device`: data may be in device memory only.
Stmt add_argument_checks(const Stmt& s, const std::vector<LoweredArgument>& args,
                         const Program& program, bool has_device);

}  // namespace retrograde::lower

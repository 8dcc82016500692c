// buffer_constraints.h -- what users promise about the buffers that are arguments of a generated function.
#pragma once

#include "graph/function.h"
#include "ir/lowered_function.h"

namespace retrograde::lower {

// The user's promise about a dimension. For a buffer that the program embeds, its actual shape. Dimension 0 is dense
// unless the user says otherwise.
BufferConstraint constraint_of(const LoweredArgument& arg, int d);

// Whether dimension 0 is dense, which is the default.
bool is_dense(const LoweredArgument& arg);

// The promised alignment of the host pointer in bytes; 1 if the type already implies it.
int32_t promised_alignment(const LoweredArgument& arg);

}  // namespace retrograde::lower

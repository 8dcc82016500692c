// make_kernels -- turn loops over blocks and threads into kernels, and insert the memory copies that they need.
// In:  Vector; loops over blocks and threads where the schedule has them.
// Out: Vector, with a Launch for each outermost loop over blocks; no other loops over blocks or threads. For storage
//      `f` that kernels access, the variable "f.buffer" is its halide_buffer_t, as for arguments.
// kernel.h lists the steps from loops to a kernel; device_buffers.h describes the copies.
// Errors: UserError for loops that cannot run in a kernel.
// Tests: test/golden/lower/make_kernels/, test/unit/gpu_*_test.cpp.
#pragma once

#include "ir/expr.h"
#include "ir/target.h"
#include "lower/device/device_buffers.h"

namespace retrograde::lower {

Stmt make_kernels(const Stmt& s, const Target& target, const GivenBuffers& given);

// The shared memory in bytes that a block can have on a device of the target: the opt-in limit of its compute
// capability.
int most_shared_bytes(const Target& target);

}  // namespace retrograde::lower

// make_kernels -- loops over blocks become kernels, and what they need on the device is there.
// In:  Vector; loops over blocks and threads where the schedule has them.
// Out: Vector, with a Launch for each outermost loop over blocks; no other loops over blocks or threads.
//      For storage `f` that kernels touch the variable "f.buffer" is its halide_buffer_t, as for
//      arguments.
// kernel.h lists the steps from loops to a kernel; device_buffers.h says how memory follows.
// Errors: UserError for loops that no kernel can run.
// Tests: test/golden/lower/make_kernels/, test/unit/gpu_*_test.cpp.
#pragma once

#include "ir/expr.h"
#include "ir/target.h"
#include "lower/device/device_buffers.h"

namespace retrograde::lower {

Stmt make_kernels(const Stmt& s, const Target& target, const GivenBuffers& given);

// The shared memory that a block can have on a device of the target, in bytes: the opt-in limit of its
// compute capability.
int most_shared_bytes(const Target& target);

}  // namespace retrograde::lower

// workloads.h -- random programs in the forms of users' programs: loops over time in a reduction domain, strided
// accesses, index arrays, and several outputs with a common program.
//
//   RandomProgram p = make_workload(choices);
//
// - Time loops: one or two earlier steps, linear and nonlinear steps, sweeps within a step, five kinds of borders, time
//   as any dimension, in either direction. Consumers read the last step, some steps or all of them.
// - Strides: strided, dilated and transposed convolutions, hops along a signal, chains of up- and downsampling,
//   remainders and selects by parity.
// - Index arrays: gathers and scatters by integer inputs, clamped or promised, and reads at constant indices.
// - Outputs: one to three, over parts of their region, some of them scalars.
//
// Extents are small and odd, often 1 or 2. Values stay of the order of 1, whatever the number of steps. Every access is
// within its input, so the program runs as machine code.
#pragma once

#include "testing/programs/program.h"

namespace retrograde::fuzz {

enum class Workload : uint8_t { Any, TimeLoops, Strides, IndexArrays };

RandomProgram make_workload(Choices& choices, Workload kind = Workload::Any);

}  // namespace retrograde::fuzz

// large.h -- random programs over images as large as users have: large enough that every rule of the
// autoscheduler finds what it is for. They are made of what such programs do: stencils, borders,
// transposes, sums of planes, convolutions, products of matrices, scans, histograms, looks into
// tables, warps, splats, averages, losses, Tuples, reductions under predicates.
//
//   RandomProgram p = make_large_program(choices, LargeSizes::Full);
//
// No value is near a jump: which branch is taken and which place is read or written is decided by
// images alone, between the steps that they are made of. So two schedules, whose rounding differs,
// compute nearly the same everywhere.
#pragma once

#include "testing/programs/program.h"

namespace retrograde::fuzz {

// Full: up to millions of elements. Small: the same structures at sizes that an interpreter can do.
enum class LargeSizes : uint8_t { Full, Small };

// The same choices give programs of the same structures, but where an image is too small for one.
RandomProgram make_large_program(Choices& choices, LargeSizes sizes);

}  // namespace retrograde::fuzz

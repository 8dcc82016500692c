// large.h -- random programs over images of realistic size, so that every rule of the autoscheduler applies somewhere.
//
// Their structures are those of users' programs: stencils, borders, transposes, sums of planes, convolutions, matrix
// products, scans, histograms, table lookups, warps, splats, averages, losses, Tuples, reductions under predicates.
//
//   RandomProgram p = make_large_program(choices, LargeSizes::Full);
//
// No value is near a jump: branches and indices depend on images alone, between the steps of their values. So two
// schedules, whose rounding differs, compute nearly the same everywhere.
#pragma once

#include "testing/programs/program.h"

namespace retrograde::fuzz {

// Full: up to millions of elements. Small: the same structures at sizes that the interpreter can handle.
enum class LargeSizes : uint8_t { Full, Small };

// The same choices give programs of the same structures, except where an image is too small for one.
RandomProgram make_large_program(Choices& choices, LargeSizes sizes);

}  // namespace retrograde::fuzz

// Programs made to break propagate_adjoints: legal, small, and odd in every way at once.
//
//   AdversaryProgram p = make_program(choices);     // the same choices make the same program
//
// Accesses: strides, divisions, remainders, clamps, diagonals, choices between indices, places that
// data decide, boundary conditions. Updates: partial, repeated, under predicates, over domains with
// odd starts and empty ones, reading what they overwrite shifted, mirrored, strided and at places
// of data. Values: branches that are NaN where they are not taken, ties, casts between all types,
// Tuples with coupled components, inline reductions, undef. Extents may be parameters.
#pragma once

#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/buffer.h"
#include "frontend/func.h"
#include "frontend/param.h"
#include "gradient/adversary/choices.h"
#include "testing/array.h"

namespace retrograde::gradient {

struct AdversaryProgram {
  std::vector<Buffer<>> images;  // floats of several types
  Buffer<int> data;              // places
  Param<float> scale;
  Param<int> count;
  std::vector<Func> funcs;   // in the order in which they were defined; the last is the output
  oracle::Region region;     // of the output
  AdjointOptions options;    // without wrt
  bool only_inputs = false;  // ask for the gradients of images and `scale` only
  const Func& output() const { return funcs.back(); }
};

// Elements in each dimension of what updates work on.
constexpr int natural_size = 5;

// UserError: the program is no legal one.
AdversaryProgram make_program(Choices& choices);

// Every definition that the output depends on, and its inputs.
std::string to_text(const AdversaryProgram& program);

}  // namespace retrograde::gradient

// Programs made to break propagate_adjoints: legal, small, and odd in every way at once.
//
//   AdversaryProgram p = make_program(choices);     // the same choices make the same program
//
// Accesses: strides, divisions, remainders, clamps, diagonals, choices between indices, places that
// data decide, boundary conditions. Updates: partial, repeated, under predicates, over domains with
// odd starts and empty ones, reading what they overwrite shifted, mirrored, strided and at places
// of data; loops over time. Structures: pyramids on borders of run-time size, bilateral grids,
// convolutions, tables, scans, domains with parametric ends that may be empty, composed boundary
// conditions. Values: branches that are NaN where they are not taken, ties, casts between all
// types, fast functions, Tuples with coupled components, inline reductions, undef. Extents may be
// parameters, or those of an ImageParam.
// Rules: stop_gradient, straight_through, custom_adjoint and custom_tangent, all so that the
// derivative is still the true one.
#pragma once

#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/data/buffer.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"
#include "frontend/language/func.h"
#include "gradient/adversary/choices.h"
#include "testing/array.h"

namespace retrograde::gradient {

// What of a program is looked at besides its gradient.
struct AdversaryChecks {
  int order = 1;        // derivatives of derivatives, up to this one
  bool dense = false;   // Jacobian and Hessian by one image
  bool along = true;    // the adjoint of a Func between
  int schedule = 0;     // seed of a schedule of the gradient as machine code; 0: none
  bool primal = false;  // the schedule is given to the primal's Funcs too
  bool wild = false;    // the seed is NaN outside of its region
  bool stage = false;   // one Func may be an extern stage instead, as machine code
  bool higher = true;   // derivatives of derivatives are those of the values (no stop_gradient)
};

struct AdversaryProgram {
  std::vector<Buffer<>> images;     // floats of several types
  std::vector<ImageParam> handles;  // one for each image, which holds it; undefined: named itself
  Buffer<int> data;                 // places
  Param<float> scale;
  Param<int> count;
  std::vector<Func> funcs;   // in the order in which they were defined; the last is the output
  oracle::Region region;     // of the output
  AdjointOptions options;    // without wrt
  bool only_inputs = false;  // ask for the gradients of images and `scale` only
  AdversaryChecks checks;

  const Func& output() const { return funcs.back(); }
  AdjointInput image(size_t i) const {
    return i < handles.size() && handles[i].defined() ? AdjointInput(handles[i])
                                                      : AdjointInput(images[i]);
  }
};

// Elements in each dimension of what updates work on.
constexpr int natural_size = 5;

// UserError: the program is no legal one. as_extern: a C function computes the Func that
// checks.stage speaks of.
AdversaryProgram make_program(Choices& choices, bool as_extern = false);

// Every definition that the output depends on, and its inputs.
std::string to_text(const AdversaryProgram& program);

}  // namespace retrograde::gradient

// Random programs of the pieces that people write images with, at sizes that no vector divides.
//
// Stencils, reductions written inline, argmin and argmax, boundary conditions, averages of rows,
// histograms, recursive filters, halved sizes; any stage may be at root. Each piece reads no more
// than what is there, so a value and a gradient that ask for more are wrong. The same choices make
// the same program.
#pragma once

#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/data/buffer.h"
#include "frontend/data/param.h"
#include "frontend/language/func.h"
#include "gradient/adversary/choices.h"

namespace retrograde::gradient {

struct OddProgram {
  Buffer<float> image;
  Param<float> gain;
  Func output;
  int width = 0, height = 0;  // of the output
  std::string pieces;         // in words
};

OddProgram make_odd_program(Choices& choices);

// The value, then the gradients by image and gain under the schedule that the compiler chooses,
// against the interpreter in double as far as `operations` of it go. Empty: they run, and are
// right.
std::string check_odd_program(const OddProgram& program, uint64_t operations);

}  // namespace retrograde::gradient

// Generates random programs that stress propagate_adjoints, and chooses the checks to run on each.
#pragma once

#include "testing/programs/workloads.h"

namespace retrograde::gradient {

using fuzz::Choices;
using fuzz::natural_size;

// The checks of a program beyond the check of its gradient.
struct AdversaryChecks {
  int order = 1;           // derivatives of derivatives, up to this one
  bool dense = false;      // Jacobian and Hessian by one image
  int schedule = 0;        // seed of a schedule of the gradient as machine code; 0: none
  bool primal = false;     // the schedule is given to the primal's Funcs too
  bool wild = false;       // the seed is NaN outside of its region
  bool several = false;    // a Func before the output as a second output
  bool one_input = false;  // the gradient by one input is requested alone, too
};

struct AdversaryProgram : fuzz::RandomProgram {
  AdjointOptions options;    // without wrt
  bool only_inputs = false;  // ask for the gradients of images and `scale` only
  AdversaryChecks checks;
};

// Throws UserError if the choices describe no legal program. as_extern: a C function computes the Func that may be an
// extern stage.
AdversaryProgram make_adversary(Choices& choices, bool as_extern = false);
AdversaryProgram make_adversary(Choices& choices, const fuzz::Style& style);
// A program in the forms of users' programs, with one output or several.
AdversaryProgram make_workload_adversary(Choices& choices, fuzz::Workload kind);

std::string to_text(const AdversaryProgram& program);

}  // namespace retrograde::gradient

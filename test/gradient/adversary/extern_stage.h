// A stage that a C function computes, in random programs: sin of a Func, for machine code only.
#pragma once

#include "gradient/adversary/program.h"

namespace retrograde::gradient {

// f = sin(source), by a C function.
void define_sine(Func f, const Func& source);

}  // namespace retrograde::gradient

// An extern stage for random programs: the sine of a Func, computed by a C function, for machine code only.
#pragma once

#include "gradient/adversary/program.h"

namespace retrograde::gradient {

// Defines f = sin(source) by a C function.
void define_sine(Func f, const Func& source);

}  // namespace retrograde::gradient

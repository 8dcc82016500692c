// A stage that a C function computes, in random programs: sin of a Func, for machine code only.
#pragma once

#include "gradient/adversary/program.h"

namespace retrograde::gradient {

// f = sin(source) by a C function when `as_extern`, else as a definition.
void define_sine(const Func& f, const Func& source, bool as_extern);

}  // namespace retrograde::gradient

// device_math.h -- mathematical functions for kernels. They come from libclc built for NVPTX and consist only of
// correctly rounded arithmetic, so the simulated device gives the same bits as a GPU.
#pragma once

#include <string>

#include "codegen/emitter.h"

namespace retrograde::codegen {

// "_Z3powff" for ("pow", 32, 2).
std::string device_math_symbol(const std::string& stem, int bits, int arity);

// Links in the definitions of those functions that the module calls, and their callees.
void link_device_math(Emitter& e);

}  // namespace retrograde::codegen

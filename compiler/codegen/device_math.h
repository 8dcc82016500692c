// device_math.h -- the mathematical functions of kernels: libclc's, made for NVPTX, which are nothing but
// correctly rounded arithmetic, so that the executor's have the same bits as a device's.
#pragma once

#include <string>

#include "codegen/emitter.h"

namespace retrograde::codegen {

// "_Z3powff" for ("pow", 32, 2).
std::string device_math_symbol(const std::string& stem, int bits, int arity);

// Adds the definitions of those that the module calls, and of what they call.
void link_device_math(Emitter& e);

}  // namespace retrograde::codegen

// constant_math.h -- vector math of constants, computed while compiling.
#pragma once

#include <vector>

#include "codegen/emitter.h"
#include "codegen/math_table.h"

namespace retrograde::codegen {

// What the generated code would compute, to the bit; null when an argument is no constant, or this
// process has no function that computes the same.
Value* constant_result(Emitter& e, const MathFunction& function, const std::vector<Value*>& args);

}  // namespace retrograde::codegen

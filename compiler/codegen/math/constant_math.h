// constant_math.h -- evaluates vector math of constants at compile time.
#pragma once

#include <vector>

#include "codegen/emitter.h"
#include "codegen/math/math_table.h"

namespace retrograde::codegen {

// Returns exactly the bits that the generated code would compute. Null if an argument is not a constant, or if this
// process has no function that computes the same bits.
Value* constant_result(Emitter& e, const MathFunction& function, const std::vector<Value*>& args);

}  // namespace retrograde::codegen

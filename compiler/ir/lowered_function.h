// A function in the last phase of the IR: its arguments and one flat body, ready to become machine code.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {

struct LoweredArgument {
  enum class Kind : uint8_t { Scalar, InputBuffer, OutputBuffer };
  std::string name;
  Kind kind = Kind::Scalar;
  Type type;           // of the scalar, or of the buffer's elements
  int dimensions = 0;  // of the buffer
  SymbolRef symbol;  // the parameter or buffer that a call in process binds here; may be undefined
  bool is_buffer() const { return kind != Kind::Scalar; }
};

// Names inside the body:
//   scalar argument "k"   Variable "k"
//   buffer argument "in"  Variable "in.buffer" (Handle: halide_buffer_t*), used by the operators
//                         buffer_*;
//                         Load/Store with name "in" address element `index` from its host pointer.
//                         The host pointer may be null in a bounds query; then no Load or Store is
//                         reached.
// The body binds everything else itself. It ends normally (the function returns 0) or through an
// Assert (the code).
struct LoweredFunction {
  std::string name;
  std::vector<LoweredArgument> args;
  Stmt body;
  // The loop nest of the schedule as text, as it was when the function was lowered. Built on
  // demand: for a deep nest the regions take longer to print than to compile.
  std::function<std::string()> loop_nest;
};

}  // namespace retrograde::ir

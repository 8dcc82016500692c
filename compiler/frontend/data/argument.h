// argument.h -- the arguments of a function that is compiled ahead of time.
//
// In f.compile_to_file("f", {in, gain}, "f"), Params, ImageParams and Buffers convert to Arguments. A Buffer in
// the list is passed at run time; a Buffer outside the list is embedded in the code.
#pragma once

#include <string>

#include "frontend/language/rdom.h"
#include "graph/function.h"

namespace retrograde {

template <typename T, int Dims>
class Buffer;

// Optional facts about an argument; an undefined Expr or an empty region means unknown.
struct ArgumentEstimates {
  Expr scalar_def, scalar_min, scalar_max, scalar_estimate;  // of scalars
  Region buffer_estimates;  // of buffers: empty, or one Range for each dimension
  friend bool operator==(const ArgumentEstimates& a, const ArgumentEstimates& b);
};

// One argument of an ahead-of-time function. Params, ImageParams and Buffers convert to it.
struct Argument {
  // Scalar or buffer, input or output.
  enum Kind { InputScalar = 0, InputBuffer = 1, OutputBuffer = 2 };
  std::string name;                      // name in the generated signature
  Kind kind = InputScalar;               // role in the call
  uint8_t dimensions = 0;                // of a buffer
  Type type;                             // of the scalar, or of the buffer's elements
  ArgumentEstimates argument_estimates;  // limits, default and estimates

  Argument() = default;  // an unnamed scalar input
  // An argument with the given properties.
  // Requires: a buffer has 0 to 255 dimensions, a scalar has none.
  Argument(std::string name, Kind kind, const Type& type, int dimensions,
           ArgumentEstimates estimates = {});
  // An input buffer that is passed at run time instead of being embedded in the code.
  template <typename T, int Dims>
  Argument(const Buffer<T, Dims>& buffer)
      : Argument(buffer.name(), InputBuffer, buffer.type(), buffer.dimensions()) {}

  bool is_buffer() const { return kind != InputScalar; }   // a buffer, input or output
  bool is_scalar() const { return kind == InputScalar; }   // a scalar input
  bool is_input() const { return kind != OutputBuffer; }   // a scalar or buffer that is read
  bool is_output() const { return kind == OutputBuffer; }  // a buffer that is written
  friend bool operator==(const Argument& a, const Argument& b);
};

namespace frontend {
// Describes a parameter as an input, with its name, limits, value and estimates.
Argument argument_of(const ParameterContents& parameter);
}  // namespace frontend

}  // namespace retrograde

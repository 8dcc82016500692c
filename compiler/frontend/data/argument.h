// argument.h -- what a function compiled ahead of time takes.
//
// f.compile_to_file("f", {in, gain}, "f"): Params, ImageParams and Buffers turn into Arguments.
// (A Buffer in the list comes at run time; one that is not in the list is embedded in the code.)
#pragma once

#include <string>

#include "frontend/language/rdom.h"
#include "graph/function.h"

namespace retrograde {

template <typename T, int Dims>
class Buffer;

// What is known of an argument besides its type; undefined where nothing is.
struct ArgumentEstimates {
  Expr scalar_def, scalar_min, scalar_max, scalar_estimate;  // of scalars
  Region buffer_estimates;  // of buffers: empty, or one Range for each dimension
  friend bool operator==(const ArgumentEstimates& a, const ArgumentEstimates& b);
};

struct Argument {
  enum Kind { InputScalar = 0, InputBuffer = 1, OutputBuffer = 2 };
  std::string name;
  Kind kind = InputScalar;
  uint8_t dimensions = 0;  // of a buffer
  Type type;               // of the scalar, or of the buffer's elements
  ArgumentEstimates argument_estimates;

  Argument() = default;
  // Requires: a buffer has 0 to 255 dimensions, a scalar has none.
  Argument(std::string name, Kind kind, const Type& type, int dimensions,
           ArgumentEstimates estimates = {});
  template <typename T, int Dims>
  Argument(const Buffer<T, Dims>& buffer)
      : Argument(buffer.name(), InputBuffer, buffer.type(), buffer.dimensions()) {}

  bool is_buffer() const { return kind != InputScalar; }
  bool is_scalar() const { return kind == InputScalar; }
  bool is_input() const { return kind != OutputBuffer; }
  bool is_output() const { return kind == OutputBuffer; }
  friend bool operator==(const Argument& a, const Argument& b);
};

namespace frontend {
// An input; name, limits, value and estimates are taken from the parameter.
Argument argument_of(const ParameterContents& parameter);
}  // namespace frontend

}  // namespace retrograde

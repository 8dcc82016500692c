// parameter_contents.h -- what compiled code takes as an argument: a scalar (Param), an image
// (ImageParam) or a Buffer that the program names.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "graph/schedule.h"
#include "ir/expr.h"
#include "ir/scalar.h"

struct halide_buffer_t;

namespace retrograde::graph {

// Parameter of the compiled function: scalar (Param), image (ImageParam), or an embedded Buffer.
struct BufferConstraint {
  Expr min, extent, stride;  // undefined: unconstrained, but see any_stride
  Expr min_estimate, extent_estimate;
  bool any_stride = false;  // set_stride(Expr()): lifts the promise that dimension 0 is dense
};
struct FuncContents;
struct ParameterContents : Symbol {
  std::string name;
  Type type;
  bool is_buffer = false;
  // scalar
  std::optional<Scalar> value;  // current value
  Expr min_value, max_value, estimate;
  // buffer
  int dimensions = 0;
  std::vector<BufferConstraint> constraints;
  std::shared_ptr<void> buffer_owner;  // keeps `buffer` alive
  halide_buffer_t* buffer = nullptr;   // currently bound; null when unset
  bool is_literal = false;             // a Buffer named in the program, not an ImageParam
  int host_alignment =
      0;  // promise, in bytes, about the address of element min; 0: the type's size
  bool is_finite = false;  // promise: no call's values are infinite or NaN
  uint64_t version = 0;    // grows when anything but the value or the bound buffer changes
  TraceSchedule trace;
  // The Func that an ImageParam converts to: what reads the image reads it instead. Null when
  // nobody asked for it.
  std::shared_ptr<FuncContents> func;
};

}  // namespace retrograde::graph

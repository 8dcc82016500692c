// parameter_contents.h -- the parameters of compiled code: scalars (Param), images (ImageParam),
// and Buffers that the program embeds.
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

// The constraints on one dimension of a buffer, and its estimates.
struct BufferConstraint {
  Expr min, extent, stride;  // undefined: unconstrained, but see any_stride
  Expr min_estimate, extent_estimate;
  bool any_stride = false;  // set_stride(Expr()): dimension 0 need not be dense
};
struct FuncContents;
struct ParameterContents : Symbol {
  std::string name;
  Type type;
  bool is_buffer = false;
  // Scalars only.
  std::optional<Scalar> value;  // the current value
  Expr min_value, max_value, estimate;
  // Buffers only.
  int dimensions = 0;
  std::vector<BufferConstraint> constraints;
  std::shared_ptr<void> buffer_owner;  // keeps `buffer` alive
  halide_buffer_t* buffer = nullptr;   // the bound buffer; null when unset
  bool is_literal = false;             // a Buffer embedded in the program, not an ImageParam
  int host_alignment =
      0;  // promised alignment in bytes of the address of element min; 0: the type's size
  bool is_finite = false;  // promise: no call passes infinite values or NaN
  uint64_t version = 0;    // increases when anything but the value or the bound buffer changes
  TraceSchedule trace;
  // The Func that an ImageParam converts to; consumers of the image read that Func. Null until
  // first requested.
  std::shared_ptr<FuncContents> func;
};

}  // namespace retrograde::graph

#include "lower/checks/buffer_constraints.h"

#include <HalideRuntime.h>

#include "ir/build.h"

namespace retrograde::lower {

BufferConstraint constraint_of(const LoweredArgument& arg, int d) {
  auto param = std::dynamic_pointer_cast<ParameterContents>(arg.symbol.lock());
  BufferConstraint promised;
  if (param && d < static_cast<int>(param->constraints.size())) promised = param->constraints[d];
  if (d == 0 && !promised.stride.defined() && !promised.any_stride) promised.stride = 1;
  if (param && param->is_literal && param->buffer) {
    const halide_dimension_t& dim = param->buffer->dim[d];
    promised.min = dim.min;
    promised.extent = dim.extent;
    promised.stride = dim.stride;
  }
  return promised;
}

bool is_dense(const LoweredArgument& arg) {
  return arg.dimensions > 0 && is_const_int(constraint_of(arg, 0).stride, 1);
}

int32_t promised_alignment(const LoweredArgument& arg) {
  const auto param = std::dynamic_pointer_cast<ParameterContents>(arg.symbol.lock());
  return param && param->host_alignment > arg.type.bytes() ? param->host_alignment : 1;
}

}  // namespace retrograde::lower

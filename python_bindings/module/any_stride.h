// any_stride.h -- arrays whose last axis is not dense: a[:, ::2], a.T, the channels of an image.
//
// Compiled code takes for granted that dimension 0 of a buffer is dense, unless dim(0).set_stride(None) lifts that.
// Arrays of Python come with any strides, and who passes one has said what its strides are: so passing one that is
// not dense lifts it, where the program has not promised another stride itself. The pipeline is then compiled anew,
// once.
#pragma once

#include "frontend/data/buffer.h"

namespace retrograde::python {

inline void allow_stride_of(graph::ParameterContents& parameter, const Buffer<>& buffer) {
  if (parameter.constraints.empty() || !buffer.defined() || buffer.dimensions() == 0) return;
  graph::BufferConstraint& first = parameter.constraints[0];
  if (buffer.stride(0) == 1 || buffer.extent(0) <= 1 || first.stride.defined() || first.any_stride)
    return;
  first.any_stride = true;
  parameter.version++;
}

}  // namespace retrograde::python

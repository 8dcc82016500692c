// any_stride.h -- arrays whose last axis is not dense: a[:, ::2], a.T, the channels of an image.
//
// Compiled code takes for granted that dimension 0 of a buffer is dense, unless dim(0).set_stride(None) lifts that.
// Arrays of Python come with any strides, and who passes one has said what its strides are: so passing one that is
// not dense lifts it, where the program has not promised another stride itself. The pipeline is then compiled anew,
// once.
#pragma once

#include "frontend/data/buffer.h"

namespace retrograde::python {

// Of dimension 0.
inline void allow_stride(graph::ParameterContents& parameter, int stride, int extent) {
  if (stride == 1 || extent <= 1 || parameter.constraints.empty()) return;
  graph::BufferConstraint& first = parameter.constraints[0];
  if (first.stride.defined() || first.any_stride) return;
  first.any_stride = true;
  parameter.version++;
}

inline void allow_stride_of(graph::ParameterContents& parameter, const Buffer<>& buffer) {
  if (!buffer.defined() || buffer.dimensions() == 0) return;
  allow_stride(parameter, buffer.stride(0), buffer.extent(0));
}

}  // namespace retrograde::python

// any_stride.h -- support for arrays whose last axis is not dense: a[:, ::2], a.T, the channels of an image.
//
// Compiled code assumes that dimension 0 of a buffer is dense, unless dim(0).set_stride(None) removes the assumption.
// Passing a Python array that is not dense removes it too, unless the program has promised a stride itself. The
// pipeline is then recompiled once.
#pragma once

#include "frontend/data/buffer.h"

namespace retrograde::python {

// Allows this stride for dimension 0 of a parameter.
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

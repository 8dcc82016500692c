// call_arguments.h -- converts the Python arguments of realize() and similar functions.
#pragma once

#include "binding.h"
#include "frontend/run/param_map.h"
#include "frontend/run/pipeline.h"

namespace retrograde::python {

// Outputs of a call: sizes, a Buffer or an array, or a list of these.
struct Outputs {
  std::vector<int32_t> sizes;
  std::vector<Buffer<>> buffers;
  bool are_buffers() const { return !buffers.empty(); }
};
Outputs outputs_from(const py::object& source, const std::string& asked);

// A ParamMap from a dict: {gain: 2.0, image: array}.
ParamMap param_map_from(const py::dict& values);

// Allows the strides of the output buffers, unless the program promised others (any_stride.h).
void allow_strides(const std::vector<Func>& outputs, const std::vector<Buffer<>>& buffers);

// A Buffer, or a tuple of Buffers.
py::object object_of(const Realization& realization);

}  // namespace retrograde::python

// call_arguments.h -- what realize() and its like are given by Python.
#pragma once

#include "binding.h"
#include "frontend/run/param_map.h"
#include "frontend/run/pipeline.h"

namespace retrograde::python {

// Sizes, a Buffer or an array, or a list of them.
struct Outputs {
  std::vector<int32_t> sizes;
  std::vector<Buffer<>> buffers;
  bool are_buffers() const { return !buffers.empty(); }
};
Outputs outputs_from(const py::object& given, const std::string& asked);

// {gain: 2.0, image: array}
ParamMap param_map_from(const py::dict& values);

// The strides of these are none that the code was promised otherwise (any_stride.h).
void allow_strides(const std::vector<Func>& outputs, const std::vector<Buffer<>>& buffers);

// One Buffer, or a tuple of them.
py::object object_of(const Realization& realization);

}  // namespace retrograde::python

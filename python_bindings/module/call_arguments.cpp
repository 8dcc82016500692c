// call_arguments.cpp -- converts the Python arguments of realize() and similar functions.
#include "call_arguments.h"

#include "any_stride.h"
#include "buffer_memory.h"
#include "numbers.h"

namespace retrograde::python {

namespace {

bool is_list(const py::object& object) {
  return py::isinstance<py::list>(object) || py::isinstance<py::tuple>(object);
}

// Whether it is an integer of Python or NumPy; a NumPy array without axes is not.
bool is_integer(py::handle object) {
  if (PyLong_Check(object.ptr())) return true;
  return py::isinstance(object, py::module_::import("numbers").attr("Integral"));
}

Buffer<> output_buffer(const py::object& object, const std::string& asked) {
  const auto buffer = object.cast<Buffer<>>();
  check_writable(buffer, asked);
  return buffer;
}

}  // namespace

Outputs outputs_from(const py::object& source, const std::string& asked) {
  Outputs outputs;
  if (!is_list(source)) {
    outputs.buffers.push_back(output_buffer(source, asked));
    return outputs;
  }
  for (py::handle one : source) {
    if (is_integer(one)) {
      outputs.sizes.push_back(one.attr("__index__")().cast<int32_t>());
    } else {
      outputs.buffers.push_back(output_buffer(py::reinterpret_borrow<py::object>(one), asked));
    }
  }
  if (outputs.are_buffers() && !outputs.sizes.empty()) {
    throw py::type_error("outputs are sizes or Buffers, not both");
  }
  return outputs;
}

ParamMap param_map_from(const py::dict& values) {
  ParamMap map;
  for (const auto& [key, value] : values) {
    if (py::isinstance<ImageParam>(key)) {
      const auto& image = key.cast<const ImageParam&>();
      const auto buffer = value.cast<Buffer<>>();
      map.set(image, buffer);
      allow_stride_of(*image.parameter(), buffer);
      continue;
    }
    if (!py::isinstance<Param<>>(key))
      throw py::type_error("values are those of Params and ImageParams");
    const auto& param = key.cast<const Param<>&>();
    const ir::Scalar scalar = scalar_of(param.type(), value);
    if (scalar.type.is_float())
      map.set(param, scalar.f);
    else if (scalar.type.is_int())
      map.set(param, scalar.i);
    else
      map.set(param, scalar.u);
  }
  return map;
}

void allow_strides(const std::vector<Func>& outputs, const std::vector<Buffer<>>& buffers) {
  size_t i = 0;
  for (const Func& f : outputs) {
    for (const OutputImageParam& output : f.output_buffers()) {
      if (i < buffers.size()) allow_stride_of(*output.parameter(), buffers[i++]);
    }
  }
}

py::object object_of(const Realization& realization) {
  if (realization.size() == 1) return py::cast(realization[0]);
  py::tuple buffers(realization.size());
  for (size_t i = 0; i < realization.size(); i++) buffers[i] = py::cast(realization[i]);
  return py::object(buffers);
}

}  // namespace retrograde::python

// image_param.cpp -- binds ImageParam, OutputImageParam, their Dimensions, and Argument.
#include "frontend/data/image_param.h"
#include "any_stride.h"
#include "bind_all.h"
#include "binding.h"
#include "ir/print.h"

namespace retrograde::python {

namespace {

std::string repr(const OutputImageParam& p, const char* name) {
  if (!p.defined()) return text("<retrograde.", name, ", undefined>");
  return text("<retrograde.", name, " ", quoted(p.name()), " ", to_string(p.type()), ", ",
              p.dimensions(), " dimensions>");
}

void bind_dimension(py::module_& m) {
  Class<Dimension>(m, "Dimension")
      .def("min", &Dimension::min)
      .def("extent", &Dimension::extent)
      .def("max", &Dimension::max)
      .def("stride", &Dimension::stride)
      .def("set_min", &Dimension::set_min, py::arg("min"))
      .def("set_extent", &Dimension::set_extent, py::arg("extent"))
      .def(
          "set_stride",
          [](Dimension& d, const std::optional<Expr>& stride) {
            return d.set_stride(stride.value_or(Expr()));
          },
          py::arg("stride"))
      .def("set_bounds", &Dimension::set_bounds, py::arg("min"), py::arg("extent"))
      .def("set_estimate", &Dimension::set_estimate, py::arg("min"), py::arg("extent"))
      .def("set_bounds_estimate", &Dimension::set_bounds_estimate, py::arg("min"),
           py::arg("extent"))
      .def("min_estimate", &Dimension::min_estimate)
      .def("extent_estimate", &Dimension::extent_estimate)
      .def("dim", &Dimension::dim, py::arg("dimension"));
}

void bind_argument(py::module_& m) {
  Class<Argument> c(m, "Argument");
  py::enum_<Argument::Kind>(c, "Kind")
      .value("InputScalar", Argument::InputScalar)
      .value("InputBuffer", Argument::InputBuffer)
      .value("OutputBuffer", Argument::OutputBuffer)
      .export_values();
  c.def(py::init<>())
      .def(py::init<std::string, Argument::Kind, const Type&, int>(), py::arg("name"),
           py::arg("kind"), py::arg("type"), py::arg("dimensions"))
      .def_readwrite("name", &Argument::name)
      .def_readwrite("kind", &Argument::kind)
      .def_readwrite("dimensions", &Argument::dimensions)
      .def_readwrite("type", &Argument::type)
      .def("is_buffer", &Argument::is_buffer)
      .def("is_scalar", &Argument::is_scalar)
      .def("is_input", &Argument::is_input)
      .def("is_output", &Argument::is_output)
      .def("__repr__", [](const Argument& a) {
        return "<retrograde.Argument " + quoted(a.name) + " " + to_string(a.type) +
               (a.is_buffer() ? text(", ", int(a.dimensions), " dimensions>") : ">");
      });
}

}  // namespace

void bind_image_param(py::module_& m) {
  bind_dimension(m);
  bind_argument(m);
  Class<OutputImageParam>(m, "OutputImageParam")
      .def("defined", &OutputImageParam::defined)
      .def("name", &OutputImageParam::name)
      .def("type", &OutputImageParam::type)
      .def("dimensions", &OutputImageParam::dimensions)
      .def("dim", &OutputImageParam::dim, py::arg("dimension"))
      .def("left", &OutputImageParam::left)
      .def("right", &OutputImageParam::right)
      .def("top", &OutputImageParam::top)
      .def("bottom", &OutputImageParam::bottom)
      .def("width", &OutputImageParam::width)
      .def("height", &OutputImageParam::height)
      .def("channels", &OutputImageParam::channels)
      .def("set_estimates", &OutputImageParam::set_estimates, py::arg("estimates"))
      .def("set_host_alignment", &OutputImageParam::set_host_alignment, py::arg("bytes"))
      .def("host_alignment", &OutputImageParam::host_alignment)
      .def("store_in", &OutputImageParam::store_in, py::arg("memory"))
      .def("__hash__",
           [](const OutputImageParam& p) { return std::hash<const void*>()(p.parameter().get()); })
      .def(
          "__eq__",
          [](const OutputImageParam& a, const OutputImageParam& b) {
            return a.parameter() == b.parameter();
          },
          py::is_operator())
      .def("__repr__", [](const OutputImageParam& p) { return repr(p, "OutputImageParam"); });

  Class<ImageParam, OutputImageParam>(m, "ImageParam", {"OutputImageParam"})
      .def(py::init<>())
      .def(py::init<Type, int>(), py::arg("type"), py::arg("dimensions"))
      .def(py::init<Type, int, const std::string&>(), py::arg("type"), py::arg("dimensions"),
           py::arg("name"))
      .def(
          "set",
          [](ImageParam& p, const Buffer<>& buffer) {
            p.set(buffer);
            allow_stride_of(*p.parameter(), buffer);
          },
          py::arg("buffer"))
      .def("get", &ImageParam::get)
      .def("reset", &ImageParam::reset)
      .def("promise_finite", &ImageParam::promise_finite)
      .def(
          "__getitem__",
          [](const ImageParam& p, const py::object& index) { return p(coordinates(index)); },
          py::arg("index"))
      .def("__call__",
           [](const ImageParam& p, const py::args& index) { return p(coordinates(index)); })
      .def("in_", py::overload_cast<const Func&>(&ImageParam::in), py::arg("f"))
      .def("in_", py::overload_cast<const std::vector<Func>&>(&ImageParam::in), py::arg("fs"))
      .def("in_", py::overload_cast<>(&ImageParam::in))
      .def("trace_loads", &ImageParam::trace_loads)
      .def("add_trace_tag", &ImageParam::add_trace_tag, py::arg("tag"))
      .def("__repr__", [](const ImageParam& p) { return repr(p, "ImageParam"); });
}

}  // namespace retrograde::python

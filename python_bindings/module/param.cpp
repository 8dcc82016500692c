// param.cpp -- binds Param, whose type is an argument of the constructor.
#include "frontend/data/param.h"
#include "bind_all.h"
#include "binding.h"
#include "numbers.h"

namespace retrograde::python {

namespace {

void set(Param<>& param, const py::object& value) {
  frontend::set_scalar(*param.parameter(), scalar_of(param.type(), value));
}

Param<> make_param(Type type, const std::string& name, const py::object& value,
                   const py::object& min, const py::object& max) {
  Param<> param(type, name);
  if (!value.is_none()) set(param, value);
  if (!min.is_none()) param.set_min_value(operand_for(type, min));
  if (!max.is_none()) param.set_max_value(operand_for(type, max));
  return param;
}

}  // namespace

void bind_param(py::module_& m) {
  Class<Param<>>(m, "Param")
      .def(py::init(&make_param), py::arg("type"), py::arg("name") = "",
           py::arg("value") = py::none(), py::arg("min") = py::none(), py::arg("max") = py::none())
      .def(py::init([](Type type, const py::object& value) {
             return make_param(type, "", value, py::none(), py::none());
           }),
           py::arg("type"), py::arg("value"))
      .def("name", &Param<>::name)
      .def("type", &Param<>::type)
      .def("get",
           [](const Param<>& p) {
             return object_of(frontend::get_scalar(*p.parameter(), p.type()));
           })
      .def("set", &set, py::arg("value"))
      .def(
          "set_range",
          [](Param<>& p, const py::object& min, const py::object& max) {
            p.set_range(operand_for(p.type(), min), operand_for(p.type(), max));
          },
          py::arg("min"), py::arg("max"))
      .def(
          "set_min_value",
          [](Param<>& p, const py::object& v) { p.set_min_value(operand_for(p.type(), v)); },
          py::arg("min"))
      .def(
          "set_max_value",
          [](Param<>& p, const py::object& v) { p.set_max_value(operand_for(p.type(), v)); },
          py::arg("max"))
      .def("min_value", &Param<>::min_value)
      .def("max_value", &Param<>::max_value)
      .def("promise_finite", &Param<>::promise_finite)
      .def(
          "set_estimate",
          [](Param<>& p, const py::object& v) { p.set_estimate(operand_for(p.type(), v)); },
          py::arg("value"))
      .def("__hash__",
           [](const Param<>& p) { return std::hash<const void*>()(p.parameter().get()); })
      .def("__repr__", [](const Param<>& p) {
        return "<retrograde.Param " + quoted(p.name()) + " " + to_string(p.type()) + ">";
      });
}

}  // namespace retrograde::python

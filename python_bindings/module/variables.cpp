// variables.cpp -- binds Var, RVar, RDom and Range.
#include "bind_all.h"
#include "binding.h"
#include "frontend/data/image_param.h"
#include "frontend/language/rdom.h"
#include "frontend/language/var.h"
#include "ir/print.h"

namespace retrograde::python {

namespace {

void bind_var(py::module_& m) {
  Class<Var> var(m, "Var");
  var.def(py::init<>())
      .def(py::init<const std::string&>(), py::arg("name"))
      .def("name", &Var::name)
      .def("same_as", &Var::same_as, py::arg("other"))
      .def_static("implicit", &Var::implicit, py::arg("n"))
      .def_static("outermost", &Var::outermost)
      .def("is_implicit", py::overload_cast<>(&Var::is_implicit, py::const_))
      .def("implicit_index", py::overload_cast<>(&Var::implicit_index, py::const_))
      .def("is_placeholder", py::overload_cast<>(&Var::is_placeholder, py::const_))
      .def("__hash__", [](const Var& v) { return std::hash<std::string>()(v.name()); })
      .def("__repr__", [](const Var& v) { return "Var('" + v.name() + "')"; })
      .def("__str__", &Var::name);
  m.attr("_") = Var("_");
  for (int i = 0; i < 10; i++) m.attr(("_" + std::to_string(i)).c_str()) = Var::implicit(i);
}

void bind_rvar(py::module_& m) {
  Class<RVar>(m, "RVar")
      .def(py::init<>())
      .def(py::init<const std::string&>(), py::arg("name"))
      .def("name", &RVar::name)
      .def("min", &RVar::min)
      .def("extent", &RVar::extent)
      .def("__hash__", [](const RVar& v) { return std::hash<std::string>()(v.name()); })
      .def("__repr__", [](const RVar& v) { return "RVar('" + v.name() + "')"; })
      .def("__str__", &RVar::name);
}

void bind_rdom(py::module_& m) {
  Class<RDom>(m, "RDom")
      .def(py::init<>())
      .def(py::init<const OutputImageParam&>(), py::arg("image"))
      .def(py::init([](const Buffer<>& buffer) { return RDom(buffer); }), py::arg("buffer"))
      .def(py::init<const Region&, const std::string&>(), py::arg("region"), py::arg("name") = "")
      .def("defined", &RDom::defined)
      .def("same_as", &RDom::same_as, py::arg("other"))
      .def("dimensions", &RDom::dimensions)
      .def("where", &RDom::where, py::arg("predicate"))
      .def("__len__", &RDom::dimensions)
      .def(
          "__getitem__",
          [](const RDom& r, int i) {
            const int size = r.defined() ? r.dimensions() : 0;
            if (i < -size || i >= size)
              throw py::index_error(text("there are ", size, " variables, numbered from 0"));
            return r[i < 0 ? size + i : i];
          },
          py::arg("index"))
      .def_readonly("x", &RDom::x)
      .def_readonly("y", &RDom::y)
      .def_readonly("z", &RDom::z)
      .def_readonly("w", &RDom::w)
      .def("__hash__", [](const RDom& r) { return std::hash<const void*>()(r.domain().get()); })
      .def("__repr__", [](const RDom& r) {
        if (!r.defined()) return std::string("<retrograde.RDom, not given a domain>");
        return "<retrograde." + text(r) + ">";
      });
}

}  // namespace

void bind_variables(py::module_& m) {
  Class<Range>(m, "Range")
      .def(py::init<>())
      .def(py::init([](const Expr& min, const Expr& extent) {
             return Range{min, extent};
           }),
           py::arg("min"), py::arg("extent"))
      .def_readwrite("min", &Range::min)
      .def_readwrite("extent", &Range::extent)
      .def("__iter__", [](const Range& r) { return py::iter(py::make_tuple(r.min, r.extent)); })
      .def("__repr__",
           [](const Range& r) { return "Range(" + text(r.min) + ", " + text(r.extent) + ")"; });
  bind_var(m);
  bind_rvar(m);
  bind_rdom(m);
}

}  // namespace retrograde::python

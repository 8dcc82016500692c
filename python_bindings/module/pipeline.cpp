// pipeline.cpp -- binds Pipeline.
#include "bind_all.h"
#include "runnable.h"

namespace retrograde::python {

void bind_pipeline(py::module_& m) {
  Class<Pipeline> c(m, "Pipeline", {"Runnable"});
  c.def(py::init<>())
      .def(py::init([](const Func& output) { return Pipeline(output); }), py::arg("output"))
      .def(py::init<const std::vector<Func>&>(), py::arg("outputs"))
      .def("defined", &Pipeline::defined)
      .def("outputs", &Pipeline::outputs)
      .def("get_func", &Pipeline::get_func, py::arg("index"))
      .def("invalidate_cache", &Pipeline::invalidate_cache)
      .def("trace_pipeline", &Pipeline::trace_pipeline)
      .def(
          "add_requirement",
          [](Pipeline& p, const Expr& condition, const py::args& message) {
            p.add_requirement(condition, message.cast<std::vector<Expr>>());
          },
          py::arg("condition"))
      .def("unscheduled", &Pipeline::unscheduled)
      .def("__repr__", [](const Pipeline& p) {
        if (!p.defined()) return std::string("<retrograde.Pipeline without outputs>");
        return "<retrograde.Pipeline of " +
               listed(p.outputs(), [](const Func& f) { return f.name(); }) + ">";
      });
  bind_running(c);
}

}  // namespace retrograde::python

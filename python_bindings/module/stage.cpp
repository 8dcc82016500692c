// stage.cpp -- binds LoopLevel and Stage.
#include "bind_all.h"
#include "loop_directives.h"

namespace retrograde::python {

void bind_stage(py::module_& m) {
  Class<LoopLevel>(m, "LoopLevel")
      .def(py::init<>())
      .def(py::init(
               [](const Func& f, VarOrRVar var, int stage) { return LoopLevel(f, var, stage); }),
           py::arg("f"), py::arg("var"), py::arg("stage_index") = -1)
      .def_static("inlined", &LoopLevel::inlined)
      .def_static("root", &LoopLevel::root)
      .def("set", &LoopLevel::set, py::arg("other"))
      .def("lock", &LoopLevel::lock)
      .def("defined", &LoopLevel::defined)
      .def("is_inlined", &LoopLevel::is_inlined)
      .def("is_root", &LoopLevel::is_root)
      .def("func", &LoopLevel::func)
      .def("var", &LoopLevel::var)
      .def("stage_index", &LoopLevel::stage_index)
      .def("to_string", &LoopLevel::to_string)
      .def(
          "__eq__", [](const LoopLevel& a, const LoopLevel& b) { return a == b; },
          py::is_operator())
      .def(
          "__ne__", [](const LoopLevel& a, const LoopLevel& b) { return a != b; },
          py::is_operator())
      .def("__repr__", [](const LoopLevel& l) {
        return "<retrograde.LoopLevel " + (l.defined() ? l.to_string() : "undefined") + ">";
      });

  Class<Stage> c(m, "Stage", {"LoopDirectives"});
  c.def("name", &Stage::name)
      .def("index", &Stage::index)
      .def("dump_argument_list", &Stage::dump_argument_list)
      .def("split_vars", &Stage::split_vars)
      .def("source_location", &Stage::source_location)
      .def("rfactor", py::overload_cast<const std::vector<std::pair<RVar, Var>>&>(&Stage::rfactor),
           py::arg("preserved"))
      .def("rfactor", py::overload_cast<const RVar&, const Var&>(&Stage::rfactor), py::arg("r"),
           py::arg("v"))
      .def("__repr__", [](const Stage& s) { return "<retrograde.Stage " + s.name() + ">"; });
  bind_loop_directives(c);
}

}  // namespace retrograde::python

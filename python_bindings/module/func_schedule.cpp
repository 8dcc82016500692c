// func_schedule.cpp -- binds the directives of Func: compute and storage levels, bounds, wrappers.
#include "bind_all.h"
#include "frontend/data/param.h"
#include "func_class.h"
#include "loop_directives.h"

namespace retrograde::python {

namespace {

using py::arg;

std::vector<Var> vars_of(const py::args& args) {
  if (args.size() == 1 && !py::isinstance<Var>(args[0])) return args[0].cast<std::vector<Var>>();
  return py::list(args).cast<std::vector<Var>>();
}

// A level by a consumer and one of its loops (Var, RVar or an RDom of one variable), or as a LoopLevel.
void bind_place(FuncClass& c, const char* name, Func& (Func::*directive)(const LoopLevel&)) {
  c.def(
       name,
       [directive](Func& f, const Func& consumer, VarOrRVar var) -> Func& {
         return (f.*directive)(LoopLevel(consumer, var));
       },
       arg("f"), arg("var"))
      .def(name, directive, arg("level"));
}

void bind_places(FuncClass& c) {
  c.def("compute_inline", &Func::compute_inline).def("compute_root", &Func::compute_root);
  bind_place(c, "compute_at", &Func::compute_at);
  c.def("store_root", &Func::store_root);
  bind_place(c, "store_at", &Func::store_at);
  bind_place(c, "hoist_storage", &Func::hoist_storage);
  c.def("hoist_storage_root", &Func::hoist_storage_root)
      .def("store_in", &Func::store_in, arg("memory"))
      .def("reorder_storage",
           [](Func& f, const py::args& dims) -> Func& { return f.reorder_storage(vars_of(dims)); })
      .def("align_storage", &Func::align_storage, arg("dim"), arg("alignment"))
      .def("fold_storage", &Func::fold_storage, arg("dim"), arg("extent"),
           arg("fold_forward") = true)
      .def("bound_storage", &Func::bound_storage, arg("dim"), arg("bound"))
      .def(
          "memoize", [](Func& f, const EvictionKey& key) -> Func& { return f.memoize(key); },
          arg("eviction_key") = EvictionKey())
      .def("ring_buffer", &Func::ring_buffer, arg("copies"))
      .def("async_", &Func::async)
      .def("copy_to_device", [](Func& f) { return f.copy_to_device(); })
      .def("copy_to_host", &Func::copy_to_host);
}

void bind_sizes(FuncClass& c) {
  c.def("bound", &Func::bound, arg("var"), arg("min"), arg("extent"))
      .def("bound_extent", &Func::bound_extent, arg("var"), arg("extent"))
      .def("align_bounds", &Func::align_bounds, arg("var"), arg("modulus"),
           arg("remainder") = Expr(0))
      .def("align_extent", &Func::align_extent, arg("var"), arg("modulus"))
      .def("set_estimate", &Func::set_estimate, arg("var"), arg("min"), arg("extent"))
      .def("set_estimates", &Func::set_estimates, arg("estimates"));
}

void bind_wrappers(FuncClass& c) {
  c.def("in_", py::overload_cast<const Func&>(&Func::in), arg("f"))
      .def("in_", py::overload_cast<const std::vector<Func>&>(&Func::in), arg("fs"))
      .def("in_", py::overload_cast<>(&Func::in))
      .def("clone_in", py::overload_cast<const Func&>(&Func::clone_in), arg("f"))
      .def("clone_in", py::overload_cast<const std::vector<Func>&>(&Func::clone_in), arg("fs"))
      .def(
          "copy_input", [](Func& f, const ImageParam& image) { return f.copy_input(image); },
          arg("image"))
      .def(
          "copy_input", [](Func& f, const Buffer<>& image) { return f.copy_input(image); },
          arg("image"));
}

void bind_watching(FuncClass& c) {
  c.def("trace_loads", &Func::trace_loads)
      .def("trace_stores", &Func::trace_stores)
      .def("trace_realizations", &Func::trace_realizations)
      .def("add_trace_tag", &Func::add_trace_tag, arg("tag"))
      .def("debug_to_file", &Func::debug_to_file, arg("filename"))
      .def("update", &Func::update, arg("index") = 0)
      .def("stage", &Func::stage, arg("index"))
      .def("output_buffer", &Func::output_buffer)
      .def("output_buffers", &Func::output_buffers);
}

}  // namespace

void bind_func_schedule(py::module_& m) {
  Class<EvictionKey>(m, "EvictionKey")
      .def(py::init<Expr>(), arg("key") = Expr())
      .def("key", &EvictionKey::key);
  FuncClass c = reopened<Func>(m, "Func", {"LoopDirectives", "Runnable"});
  bind_places(c);
  bind_sizes(c);
  bind_wrappers(c);
  bind_watching(c);
  bind_loop_directives(c);
  // In f.compute_with(g, x), g means its first stage.
  py::implicitly_convertible<Func, Stage>();
  reopened<Stage>(m, "Stage", {})
      .def(py::init([](const Func& f) { return Stage(f); }), py::arg("f"));
}

}  // namespace retrograde::python

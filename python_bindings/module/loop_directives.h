// loop_directives.h -- binds the loop directives that Func and Stage share.
#pragma once

#include <vector>

#include "binding.h"
#include "frontend/language/func.h"

namespace retrograde::python {

using Alignment = std::vector<std::pair<VarOrRVar, LoopAlignStrategy>>;

// Loops given as arguments or as one list: reorder(x, y) and reorder([x, y]).
inline std::vector<VarOrRVar> loops_of(const py::args& args) {
  std::vector<VarOrRVar> loops;
  const auto add = [&](const auto& self, py::handle object) -> void {
    if (py::isinstance<py::list>(object) || py::isinstance<py::tuple>(object)) {
      for (py::handle one : object) self(self, one);
      return;
    }
    const std::optional<VarOrRVar> loop = loop_from(object);
    if (!loop) throw py::type_error("a loop is a Var, an RVar or an RDom of one variable");
    loops.push_back(*loop);
  };
  for (py::handle object : args) add(add, object);
  return loops;
}

template <class Self>
void bind_loop_shapes(Class<Self>& c) {
  using py::arg;
  constexpr auto automatic = TailStrategy::Auto;
  c.def("split", &Self::split, arg("old"), arg("outer"), arg("inner"), arg("factor"),
        arg("tail") = automatic)
      .def("fuse", &Self::fuse, arg("inner"), arg("outer"), arg("fused"))
      .def("rename", &Self::rename, arg("old_name"), arg("new_name"))
      .def("reorder",
           [](Self& s, const py::args& loops) -> Self& { return s.reorder(loops_of(loops)); })
      .def(
          "tile",
          [](Self& s, VarOrRVar x, VarOrRVar y, VarOrRVar xo, VarOrRVar yo, VarOrRVar xi,
             VarOrRVar yi, Expr xfactor, Expr yfactor, TailStrategy tail) -> Self& {
            return s.tile(x, y, xo, yo, xi, yi, xfactor, yfactor, tail);
          },
          arg("x"), arg("y"), arg("xo"), arg("yo"), arg("xi"), arg("yi"), arg("xfactor"),
          arg("yfactor"), arg("tail") = automatic)
      .def(
          "tile",
          [](Self& s, VarOrRVar x, VarOrRVar y, VarOrRVar xi, VarOrRVar yi, Expr xfactor,
             Expr yfactor,
             TailStrategy tail) -> Self& { return s.tile(x, y, xi, yi, xfactor, yfactor, tail); },
          arg("x"), arg("y"), arg("xi"), arg("yi"), arg("xfactor"), arg("yfactor"),
          arg("tail") = automatic)
      .def(
          "tile",
          [](Self& s, const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& outers,
             const std::vector<VarOrRVar>& inners, const std::vector<Expr>& factors,
             TailStrategy tail) -> Self& {
            return s.tile(previous, outers, inners, factors, tail);
          },
          arg("previous"), arg("outers"), arg("inners"), arg("factors"), arg("tail") = automatic)
      .def(
          "tile",
          [](Self& s, const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& inners,
             const std::vector<Expr>& factors,
             TailStrategy tail) -> Self& { return s.tile(previous, inners, factors, tail); },
          arg("previous"), arg("inners"), arg("factors"), arg("tail") = automatic);
}

template <class Self>
void bind_loop_kinds(Class<Self>& c) {
  using py::arg;
  constexpr auto automatic = TailStrategy::Auto;
  using OneLoop = Self& (Self::*)(const VarOrRVar&);
  using Split = Self& (Self::*)(const VarOrRVar&, const Expr&, TailStrategy);
  c.def("serial", &Self::serial, arg("var"))
      .def("parallel", static_cast<OneLoop>(&Self::parallel), arg("var"))
      .def("vectorize", static_cast<OneLoop>(&Self::vectorize), arg("var"))
      .def("unroll", static_cast<OneLoop>(&Self::unroll), arg("var"))
      .def("parallel", static_cast<Split>(&Self::parallel), arg("var"), arg("task_size"),
           arg("tail") = automatic)
      .def("vectorize", static_cast<Split>(&Self::vectorize), arg("var"), arg("factor"),
           arg("tail") = automatic)
      .def("unroll", static_cast<Split>(&Self::unroll), arg("var"), arg("factor"),
           arg("tail") = automatic)
      .def("partition", &Self::partition, arg("var"), arg("partition"))
      .def("never_partition",
           [](Self& s, const py::args& v) -> Self& { return s.never_partition(loops_of(v)); })
      .def("always_partition",
           [](Self& s, const py::args& v) -> Self& { return s.always_partition(loops_of(v)); })
      .def("never_partition_all", &Self::never_partition_all)
      .def("always_partition_all", &Self::always_partition_all)
      .def("atomic", &Self::atomic, arg("override_associativity_test") = false)
      .def("allow_race_conditions", &Self::allow_race_conditions)
      .def("eager_inline",
           [](Self& s, const py::args& funcs) -> Self& {
             return s.eager_inline(funcs.cast<std::vector<Func>>());
           })
      .def("stream_stores", [](Self& s) -> Self& { return s.stream_stores(); })
      .def("stream_loads",
           [](Self& s, const py::args& funcs) -> Self& {
             return s.stream_loads(funcs.cast<std::vector<Func>>());
           })
      .def("unscheduled", &Self::unscheduled);
}

// Prefetching of a Func or an image, an argument called `name`.
template <class Source, class Self>
void bind_prefetch(Class<Self>& c, const char* name) {
  using py::arg;
  c.def(
      "prefetch",
      [](Self& s, const Source& source, VarOrRVar at, VarOrRVar from, Expr offset,
         PrefetchBoundStrategy strategy) -> Self& {
        return s.prefetch(source, at, from, offset, strategy);
      },
      arg(name), arg("at"), arg("from_"), arg("offset") = Expr(1),
      arg("strategy") = PrefetchBoundStrategy::GuardWithIf);
}

template <class Self>
void bind_loop_places(Class<Self>& c) {
  using py::arg;
  constexpr auto automatic = LoopAlignStrategy::Auto;
  c.def(
       "compute_with",
       [](Self& s, const LoopLevel& level, LoopAlignStrategy align) -> Self& {
         return s.compute_with(level, align);
       },
       arg("level"), arg("align") = automatic)
      .def(
          "compute_with",
          [](Self& s, const LoopLevel& level, const Alignment& align) -> Self& {
            return s.compute_with(level, align);
          },
          arg("level"), arg("align"))
      .def(
          "compute_with",
          [](Self& s, const Stage& stage, VarOrRVar var, LoopAlignStrategy align) -> Self& {
            return s.compute_with(stage, var, align);
          },
          arg("stage"), arg("var"), arg("align") = automatic)
      .def(
          "compute_with",
          [](Self& s, const Stage& stage, VarOrRVar var, const Alignment& align) -> Self& {
            return s.compute_with(stage, var, align);
          },
          arg("stage"), arg("var"), arg("align"))
      .def("specialize", &Self::specialize, arg("condition"))
      .def("specialize_fail", &Self::specialize_fail, arg("message"));
  bind_prefetch<ImageParam>(c, "image");
  bind_prefetch<Func>(c, "f");
  c.def(
      "hexagon", [](Self& s, VarOrRVar x) -> Self& { return s.hexagon(x); }, arg("x"));
}

template <class Self>
void bind_loops_on_gpus(Class<Self>& c) {
  using py::arg;
  using V = const VarOrRVar&;
  using E = const Expr&;
  using Tail = TailStrategy;
  constexpr auto automatic = TailStrategy::Auto;
  constexpr auto any = DeviceAPI::Default_GPU;
  const auto by_dimensions = [&](const char* name, auto one, auto two, auto three) {
    c.def(name, one, arg("x"), arg("device") = any)
        .def(name, two, arg("x"), arg("y"), arg("device") = any)
        .def(name, three, arg("x"), arg("y"), arg("z"), arg("device") = any);
  };
  by_dimensions("gpu_blocks", py::overload_cast<V, DeviceAPI>(&Self::gpu_blocks),
                py::overload_cast<V, V, DeviceAPI>(&Self::gpu_blocks),
                py::overload_cast<V, V, V, DeviceAPI>(&Self::gpu_blocks));
  by_dimensions("gpu_threads", py::overload_cast<V, DeviceAPI>(&Self::gpu_threads),
                py::overload_cast<V, V, DeviceAPI>(&Self::gpu_threads),
                py::overload_cast<V, V, V, DeviceAPI>(&Self::gpu_threads));
  c.def("gpu_lanes", &Self::gpu_lanes, arg("x"), arg("device") = any)
      .def("gpu_single_thread", &Self::gpu_single_thread, arg("device") = any)
      .def("gpu", py::overload_cast<V, V, DeviceAPI>(&Self::gpu), arg("block_x"), arg("thread_x"),
           arg("device") = any)
      .def("gpu", py::overload_cast<V, V, V, V, DeviceAPI>(&Self::gpu), arg("block_x"),
           arg("block_y"), arg("thread_x"), arg("thread_y"), arg("device") = any)
      .def("gpu", py::overload_cast<V, V, V, V, V, V, DeviceAPI>(&Self::gpu), arg("block_x"),
           arg("block_y"), arg("block_z"), arg("thread_x"), arg("thread_y"), arg("thread_z"),
           arg("device") = any)
      .def("gpu_tile", py::overload_cast<V, V, E, Tail, DeviceAPI>(&Self::gpu_tile), arg("x"),
           arg("tx"), arg("x_size"), arg("tail") = automatic, arg("device") = any)
      .def("gpu_tile", py::overload_cast<V, V, V, E, Tail, DeviceAPI>(&Self::gpu_tile), arg("x"),
           arg("bx"), arg("tx"), arg("x_size"), arg("tail") = automatic, arg("device") = any)
      .def("gpu_tile", py::overload_cast<V, V, V, V, E, E, Tail, DeviceAPI>(&Self::gpu_tile),
           arg("x"), arg("y"), arg("tx"), arg("ty"), arg("x_size"), arg("y_size"),
           arg("tail") = automatic, arg("device") = any)
      .def("gpu_tile", py::overload_cast<V, V, V, V, V, V, E, E, Tail, DeviceAPI>(&Self::gpu_tile),
           arg("x"), arg("y"), arg("bx"), arg("by"), arg("tx"), arg("ty"), arg("x_size"),
           arg("y_size"), arg("tail") = automatic, arg("device") = any)
      .def("gpu_tile",
           py::overload_cast<V, V, V, V, V, V, E, E, E, Tail, DeviceAPI>(&Self::gpu_tile), arg("x"),
           arg("y"), arg("z"), arg("tx"), arg("ty"), arg("tz"), arg("x_size"), arg("y_size"),
           arg("z_size"), arg("tail") = automatic, arg("device") = any)
      .def("gpu_tile",
           py::overload_cast<V, V, V, V, V, V, V, V, V, E, E, E, Tail, DeviceAPI>(&Self::gpu_tile),
           arg("x"), arg("y"), arg("z"), arg("bx"), arg("by"), arg("bz"), arg("tx"), arg("ty"),
           arg("tz"), arg("x_size"), arg("y_size"), arg("z_size"), arg("tail") = automatic,
           arg("device") = any);
}

template <class Self>
void bind_loop_directives(Class<Self>& c) {
  bind_loop_shapes(c);
  bind_loop_kinds(c);
  bind_loop_places(c);
  bind_loops_on_gpus(c);
}

}  // namespace retrograde::python

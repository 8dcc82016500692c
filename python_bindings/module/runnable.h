// runnable.h -- binds the methods that Func and Pipeline share: running in process and compiling to files.
#pragma once

#include "binding.h"
#include "call_arguments.h"
#include "frontend/run/pipeline.h"
#include "unlocked.h"

namespace retrograde::python {

inline std::vector<Func> outputs_of(const Func& f) { return {f}; }
inline std::vector<Func> outputs_of(const Pipeline& p) { return p.outputs(); }
inline std::string asked_of(const Func& f) { return "realize " + quoted(f.name()); }
inline std::string asked_of(const Pipeline&) { return "realize the Pipeline"; }

// The C++ object of a Python object, and a reference that keeps it alive.
template <class Self>
struct Pinned {
  explicit Pinned(const py::object& object) : self(object.cast<Self*>()), kept(keep(object)) {}
  Self* self;
  Kept kept;
  Self* operator->() const { return self; }
};

template <class Self>
py::object realize(const py::object& object, const py::object& outputs, const Target& target,
                   const py::dict& param_map) {
  const Pinned<Self> self(object);
  const Outputs to = outputs_from(outputs, asked_of(*self.self));
  const ParamMap map = param_map_from(param_map);
  if (!to.are_buffers()) {
    return object_of(
        unlocked([=](const Interruption&) { return self->realize(to.sizes, target, map); }));
  }
  allow_strides(outputs_of(*self.self), to.buffers);
  unlocked([=](const Interruption&) { self->realize(RealizationArg(to.buffers), target, map); });
  return py::none();
}

template <class Self>
void infer_input_bounds(const py::object& object, const py::object& outputs, const Target& target,
                        const py::dict& param_map) {
  const Pinned<Self> self(object);
  const Outputs to = outputs_from(outputs, "infer the input bounds");
  const ParamMap map = param_map_from(param_map);
  unlocked([=](const Interruption&) {
    if (to.are_buffers()) return self->infer_input_bounds(RealizationArg(to.buffers), target, map);
    self->infer_input_bounds(to.sizes, target, map);
  });
}

template <class Self>
void bind_runs(Class<Self>& c) {
  using py::arg;
  c.def("realize", &realize<Self>, arg("outputs") = py::list(), arg("target") = Target(),
        arg("param_map") = py::dict())
      .def("infer_input_bounds", &infer_input_bounds<Self>, arg("outputs"),
           arg("target") = Target(), arg("param_map") = py::dict())
      .def(
          "compile_jit",
          [](const py::object& object, const Target& target) {
            const Pinned<Self> self(object);
            unlocked([=](const Interruption&) { self->compile_jit(target); });
          },
          arg("target") = Target())
      .def(
          "loop_nest",
          [](const py::object& object, const Target& target) {
            const Pinned<Self> self(object);
            return unlocked([=](const Interruption&) { return self->loop_nest(target); });
          },
          arg("target") = Target())
      .def("print_loop_nest",
           [](const py::object& object) {
             const Pinned<Self> self(object);
             unlocked([=](const Interruption&) { self->print_loop_nest(); });
           })
      .def("infer_arguments", &Self::infer_arguments);
}

// Binds compile_to_<kind>(filename, args, function_name, target).
template <class Self, class Compile>
void bind_file(Class<Self>& c, const char* name, Compile compile) {
  using py::arg;
  c.def(
      name,
      [compile](const py::object& object, const std::string& filename,
                const std::vector<Argument>& args, const std::string& function_name,
                const std::optional<Target>& target) {
        const Pinned<Self> self(object);
        const Target to = target ? *target : get_target_from_environment();
        unlocked(
            [=](const Interruption&) { compile(*self.self, filename, args, function_name, to); });
      },
      arg("filename"), arg("arguments"), arg("function_name") = "", arg("target") = py::none());
}

template <class Self>
void bind_files(Class<Self>& c) {
  using Args = std::vector<Argument>;
  using Text = const std::string&;
#define RETROGRADE_FILE(name)                                                          \
  bind_file(c, #name, [](Self& s, Text file, const Args& a, Text f, const Target& t) { \
    s.name(file, a, f, t);                                                             \
  })
  RETROGRADE_FILE(compile_to_object);
  RETROGRADE_FILE(compile_to_bitcode);
  RETROGRADE_FILE(compile_to_llvm_assembly);
  RETROGRADE_FILE(compile_to_assembly);
  RETROGRADE_FILE(compile_to_header);
  RETROGRADE_FILE(compile_to_c);
  RETROGRADE_FILE(compile_to_file);
  RETROGRADE_FILE(compile_to_static_library);
#undef RETROGRADE_FILE
  using py::arg;
  c.def(
       "compile_to",
       [](const py::object& object, const std::map<OutputFileType, std::string>& files,
          const Args& args, const std::string& function_name, const std::optional<Target>& target) {
         const Pinned<Self> self(object);
         const Target to = target ? *target : get_target_from_environment();
         unlocked([=](const Interruption&) { self->compile_to(files, args, function_name, to); });
       },
       arg("output_files"), arg("arguments"), arg("function_name") = "", arg("target") = py::none())
      .def(
          "compile_to_lowered_stmt",
          [](const py::object& object, const std::string& filename, const Args& args,
             StmtOutputFormat format, const std::optional<Target>& target) {
            const Pinned<Self> self(object);
            const Target to = target ? *target : get_target_from_environment();
            unlocked([=](const Interruption&) {
              self->compile_to_lowered_stmt(filename, args, format, to);
            });
          },
          arg("filename"), arg("arguments"), arg("format") = StmtOutputFormat::Text,
          arg("target") = py::none())
      .def(
          "compile_to_multitarget_static_library",
          [](const py::object& object, const std::string& prefix, const Args& args,
             const std::vector<Target>& targets) {
            const Pinned<Self> self(object);
            unlocked([=](const Interruption&) {
              self->compile_to_multitarget_static_library(prefix, args, targets);
            });
          },
          arg("filename_prefix"), arg("arguments"), arg("targets"))
      .def(
          "compile_to_multitarget_object_files",
          [](const py::object& object, const std::string& prefix, const Args& args,
             const std::vector<Target>& targets, const std::vector<std::string>& suffixes) {
            const Pinned<Self> self(object);
            unlocked([=](const Interruption&) {
              self->compile_to_multitarget_object_files(prefix, args, targets, suffixes);
            });
          },
          arg("filename_prefix"), arg("arguments"), arg("targets"), arg("suffixes"));
}

template <class Self>
void bind_running(Class<Self>& c) {
  bind_runs(c);
  bind_files(c);
}

}  // namespace retrograde::python

// module_files.cpp -- binds Module, link_modules and multi-target compilation.
#include "frontend/run/module.h"

#include "bind_all.h"
#include "binding.h"
#include "callback.h"
#include "func_class.h"
#include "runnable.h"

namespace retrograde::python {

namespace {

using py::arg;
using Files = std::map<OutputFileType, std::string>;
using Names = std::map<std::string, std::string>;

void bind_functions(py::module_& m) {
  using internal::LoweredFunc;
  Class<LoweredFunc>(m, "LoweredFunc")
      .def_readonly("name", &LoweredFunc::name)
      .def_readonly("args", &LoweredFunc::args)
      .def_readonly("linkage", &LoweredFunc::linkage);
  using internal::OutputInfo;
  Class<OutputInfo>(m, "OutputInfo")
      .def_readonly("name", &OutputInfo::name)
      .def_readonly("extension", &OutputInfo::extension)
      .def_readonly("is_multi", &OutputInfo::is_multi);
  def(
      m, "get_output_info",
      [](const Target& target) {
        py::dict result;
        for (const auto& [type, info] : internal::get_output_info(target))
          result[py::cast(type)] = py::cast(info);
        return result;
      },
      arg("target"));
}

void bind_module_class(py::module_& m) {
  Class<Module>(m, "Module")
      .def(py::init<const std::string&, const Target&>(), arg("name"), arg("target"))
      .def("target", &Module::target)
      .def("name", &Module::name)
      .def("functions",
           [](const Module& module) {
             return std::vector<internal::LoweredFunc>(module.functions());
           })
      .def("submodules",
           [](const Module& module) { return std::vector<Module>(module.submodules()); })
      .def("any_strict_float", &Module::any_strict_float)
      .def("get_function_by_name", &Module::get_function_by_name, arg("name"))
      .def("append", py::overload_cast<const internal::LoweredFunc&>(&Module::append),
           arg("function"))
      .def("append", py::overload_cast<const Module&>(&Module::append), arg("module"))
      .def(
          "compile",
          [](const Module& module, const Files& files) {
            unlocked([=](const Interruption&) { module.compile(files); });
          },
          arg("output_files"))
      .def("compile_to_buffer",
           [](const Module& module) {
             return unlocked(
                 [=](const Interruption&) -> Buffer<> { return module.compile_to_buffer(); });
           })
      .def("remap_metadata_name", &Module::remap_metadata_name, arg("from_"), arg("to"))
      .def("get_metadata_name_map",
           [](const Module& module) { return Names(module.get_metadata_name_map()); })
      .def("__repr__", [](const Module& module) {
        return text("<retrograde.Module ", quoted(module.name()), " for ",
                    module.target().to_string(), ">");
      });
  def(m, "link_modules", &link_modules, arg("name"), arg("modules"));
}

void bind_standalone(py::module_& m) {
  def(
      m, "compile_standalone_runtime",
      [](const std::string& filename, const Target& target) {
        unlocked([=](const Interruption&) { compile_standalone_runtime(filename, target); });
      },
      arg("object_filename"), arg("target"));
  def(
      m, "compile_standalone_runtime",
      [](const Files& files, const Target& target) {
        return unlocked(
            [=](const Interruption&) { return compile_standalone_runtime(files, target); });
      },
      arg("output_files"), arg("target"));
  def(
      m, "compile_multitarget",
      [](const std::string& name, const Files& files, const std::vector<Target>& targets,
         const std::vector<std::string>& suffixes, const py::function& factory) {
        unlocked([=, make = Callback(factory)](const Interruption&) {
          compile_multitarget(name, files, targets, suffixes,
                              [&](const std::string& function, const Target& target) {
                                return make.call<Module>(function, target);
                              });
        });
      },
      arg("function_name"), arg("output_files"), arg("targets"), arg("suffixes"),
      arg("module_factory"));
}

template <class Self>
void bind_compile_to_module(Class<Self> c) {
  c.def(
      "compile_to_module",
      [](const py::object& object, const std::vector<Argument>& args,
         const std::string& function_name, const std::optional<Target>& target,
         LinkageType linkage) {
        const Pinned<Self> self(object);
        const Target to = target ? *target : get_target_from_environment();
        return unlocked([=](const Interruption&) {
          return self->compile_to_module(args, function_name, to, linkage);
        });
      },
      arg("arguments"), arg("function_name") = "", arg("target") = py::none(),
      arg("linkage") = LinkageType::ExternalPlusMetadata);
}

}  // namespace

void bind_module_files(py::module_& m) {
  bind_functions(m);
  bind_module_class(m);
  bind_standalone(m);
  bind_compile_to_module(reopened<Func>(m, "Func", {"Runnable"}));
  bind_compile_to_module(reopened<Pipeline>(m, "Pipeline", {"Runnable"}));
}

}  // namespace retrograde::python

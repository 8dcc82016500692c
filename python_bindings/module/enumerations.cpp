// enumerations.cpp -- binds the enumerations of directives and compilation.
#include "bind_all.h"
#include "binding.h"
#include "frontend/run/module.h"
#include "graph/directives/directive_choices.h"

namespace retrograde::python {

namespace {

// Binds an enumeration whose enumerators C++ lists by name, in order (directive_choices.h).
template <class E>
void bind_choices(py::module_& m) {
  py::enum_<E> e(m, graph::Choices<E>::name, documentation(graph::Choices<E>::name));
  int value = 0;
  for (const char* name : graph::Choices<E>::names) e.value(name, static_cast<E>(value++));
}

void bind_output_files(py::module_& m) {
  py::enum_<OutputFileType> e(m, "OutputFileType", documentation("OutputFileType"));
#define RETROGRADE_VALUE(name) e.value(#name, OutputFileType::name)
  RETROGRADE_VALUE(assembly);
  RETROGRADE_VALUE(bitcode);
  RETROGRADE_VALUE(c_header);
  RETROGRADE_VALUE(c_source);
  RETROGRADE_VALUE(compiler_log);
  RETROGRADE_VALUE(cpp_stub);
  RETROGRADE_VALUE(featurization);
  RETROGRADE_VALUE(function_info_header);
  RETROGRADE_VALUE(llvm_assembly);
  RETROGRADE_VALUE(object);
  RETROGRADE_VALUE(python_extension);
  RETROGRADE_VALUE(pytorch_wrapper);
  RETROGRADE_VALUE(registration);
  RETROGRADE_VALUE(schedule);
  RETROGRADE_VALUE(static_library);
  RETROGRADE_VALUE(stmt);
  RETROGRADE_VALUE(stmt_html);
#undef RETROGRADE_VALUE
}

}  // namespace

void bind_enumerations(py::module_& m) {
  bind_choices<TailStrategy>(m);
  bind_choices<ForType>(m);
  bind_choices<Partition>(m);
  bind_choices<MemoryType>(m);
  bind_choices<LoopAlignStrategy>(m);
  bind_choices<PrefetchBoundStrategy>(m);
  bind_output_files(m);
  py::enum_<StmtOutputFormat>(m, "StmtOutputFormat", documentation("StmtOutputFormat"))
      .value("Text", StmtOutputFormat::Text)
      .value("HTML", StmtOutputFormat::HTML);
  py::enum_<LinkageType>(m, "LinkageType", documentation("LinkageType"))
      .value("External", LinkageType::External)
      .value("ExternalPlusMetadata", LinkageType::ExternalPlusMetadata)
      .value("ExternalPlusArgv", LinkageType::ExternalPlusArgv)
      .value("Internal", LinkageType::Internal);
  py::enum_<NameMangling>(m, "NameMangling", documentation("NameMangling"))
      .value("Default", NameMangling::Default)
      .value("C", NameMangling::C)
      .value("CPlusPlus", NameMangling::CPlusPlus);
}

}  // namespace retrograde::python

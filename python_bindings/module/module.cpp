// module.cpp -- the extension module retrograde._retrograde.
#include "bind_all.h"
#include "binding.h"

PYBIND11_MODULE(_retrograde, module) {
  using namespace retrograde::python;
  module.attr("__version__") = RETROGRADE_VERSION;
  module.doc() =
      "Array pipelines whose first product is the gradient: the names of the C++ library.";
  bind_errors(module);
  bind_enumerations(module);
  bind_types(module);
  bind_target(module);
  bind_expr(module);
  bind_variables(module);
  bind_buffer(module);
  bind_param(module);
  bind_image_param(module);
  bind_func_ref(module);
  bind_stage(module);
  bind_func(module);
  bind_func_schedule(module);
  bind_func_running(module);
  bind_pipeline(module);
  bind_derivative(module);
  bind_tangents(module);
  bind_custom_derivative(module);
  bind_checks(module);
  bind_autoschedule(module);
  bind_schedule_log(module);
  bind_module_files(module);
  bind_callable(module);
  bind_externs(module);
  bind_graph_text(module);
  bind_handlers(module);
  bind_watching(module);
  bind_expr_functions(module);
  bind_integer_functions(module);
  bind_boundary_conditions(module);
  bind_inline_reductions(module);
  bind_operators(module);
  // Names that differ between Halide's Python package and its C++ library.
  const auto also = [&](const char* name, const char* cls, const char* member) {
    module.attr(name) = module.attr(cls).attr(member);
  };
  also("TargetOS", "Target", "OS");
  also("TargetArch", "Target", "Arch");
  also("TargetFeature", "Target", "Feature");
  also("ArgumentKind", "Argument", "Kind");
}

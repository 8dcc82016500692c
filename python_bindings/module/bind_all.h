// bind_all.h -- the functions that bind the parts of the module. They are called in this order, so that a class is
// bound before signatures mention it.
#pragma once

#include <pybind11/pybind11.h>

namespace retrograde::python {

void bind_errors(pybind11::module_& module);
void bind_enumerations(pybind11::module_& module);
void bind_types(pybind11::module_& module);
void bind_target(pybind11::module_& module);
void bind_expr(pybind11::module_& module);
void bind_variables(pybind11::module_& module);
void bind_expr_functions(pybind11::module_& module);
void bind_integer_functions(pybind11::module_& module);
void bind_buffer(pybind11::module_& module);
void bind_param(pybind11::module_& module);
void bind_image_param(pybind11::module_& module);
void bind_func(pybind11::module_& module);
void bind_func_ref(pybind11::module_& module);
void bind_func_schedule(pybind11::module_& module);
void bind_func_running(pybind11::module_& module);
void bind_stage(pybind11::module_& module);
void bind_pipeline(pybind11::module_& module);
void bind_derivative(pybind11::module_& module);
void bind_tangents(pybind11::module_& module);
void bind_custom_derivative(pybind11::module_& module);
void bind_checks(pybind11::module_& module);
void bind_autoschedule(pybind11::module_& module);
void bind_schedule_log(pybind11::module_& module);
void bind_module_files(pybind11::module_& module);
void bind_callable(pybind11::module_& module);
void bind_externs(pybind11::module_& module);
void bind_graph_text(pybind11::module_& module);
void bind_handlers(pybind11::module_& module);
void bind_watching(pybind11::module_& module);
void bind_boundary_conditions(pybind11::module_& module);
void bind_inline_reductions(pybind11::module_& module);
// Adds Python's operators to all classes that convert to Expr; called after these are bound.
void bind_operators(pybind11::module_& module);

}  // namespace retrograde::python

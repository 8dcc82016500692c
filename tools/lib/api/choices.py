"""Lists that no header contains: which names are public, and how programs show them."""
import re

HEADER_FOLDERS = ["frontend", "generator", "checks"]
MORE_HEADERS = [
    "autodiff/custom_derivative.h", "autodiff/derivative.h", "autodiff/jacobian.h", "autodiff/matrices/compressed.h",
    "autodiff/second_order.h", "autodiff/straight_through.h", "autodiff/tangents.h", "diagnostics/error.h", "diagnostics/pass_observer.h",
    "graph/directives/schedule_log.h", "ir/build.h", "ir/expr.h", "ir/node.h", "ir/target.h", "ir/type.h"]
INTERNAL_HEADERS = {
    "checks/arrays.h", "checks/complex_step.h", "checks/culprit.h", "checks/json_number.h",
    "checks/slopes.h", "checks/timed.h", "checks/widen.h", "frontend/data/argument.h", "frontend/data/buffer_contents.h",
    "frontend/language/operand_checks.h", "frontend/run/call.h", "frontend/run/pipeline_contents.h", "frontend/run/compiled_pipeline.h", "frontend/run/compiler_interface.h",
    "generator/command_line.h", "generator/cpp_stub.h", "generator/members.h",
    "graph/definitions/associative_update.h", "graph/text/binder.h", "graph/copy_graph.h", "graph/definitions/define.h",
    "graph/directives/directive.h", "graph/directives/directive_choices.h", "graph/directives/directive_fields.h", "graph/directives/directive_text.h",
    "graph/function.h", "graph/directives/give_directive.h", "graph/graph.h", "graph/text/graph_lines.h", "graph/names.h", "graph/definitions/parameter_contents.h", "graph/definitions/provenance.h",
    "graph/definitions/race_checks.h", "graph/definitions/reduction_domain.h", "graph/definitions/reduction_leaves.h", "graph/definitions/rfactor.h", "graph/schedule.h",
    "graph/directives/wrappers.h", "lower/lower.h"}
# Parts of templates that users never name by themselves.
INTERNAL_SCOPES = {"Declared", "ArrayTraits", "ElementTraits", "InputValue", "InputElements", "ScalarElements",
                   "OutputElements", "GeneratorParamBase::InCpp", "RegisterGenerator", "tell_pass_observers",
                   "GeneratorInputBase::values", "GeneratorInputBase::value_of", "GeneratorOutput::OutputElements", "ParamMap::Entry", "AutoScheduleParam"}
INTERNAL_NAMES = re.compile(
    r"contents|function|parameter|symbol|raw|handle|make_funcs|make_parameters|in_cpp|set_from_string|set_values|"
    r"set_from_loop_level|check_\w+|role_name|element_name|cpp_\w+|read_\w+|type_choices|number_text|param_text|"
    r"keeps_value|ElementOf|IsScalarIO|IsArrayIO|any_size|get_schedule|spec|entry|Ref|key|constant_for_input|"
    r"input_value|set_input|operator=|init_from_context|generate_all|schedule_all|is_generated|set_stub_name|"
    r"allowed|said_by|Var|generator|GeneratorFactory|RegisterGenerator|NamesInterface|IOKind|kind|"
    r"GeneratorParamsMap|set_inputs|emit_cpp_stub")

# Patterns by which programs show an object whose class they rarely name.
SHOWN_BY = {
    "Dimension": r"\.dim\(", "OutputImageParam": r"ImageParam|output_buffer", "JITHandlers": r"jit_handlers|JITUserContext",
    "FuncTupleElementRef": r"\)\[\d\]", "FuncRef": r"Func", "Realization": r"realize", "Stage": r"update\(|Func",
    "GeneratorPort": r"(Input|Output)<", "GeneratorInputBase": r"Input<",
    "GeneratorInput": r"Input<", "GeneratorOutputBase": r"Output<", "GeneratorOutput": r"Output<",
    "GeneratorParamBase": r"GeneratorParam<", "GeneratorBase": r"Generator<|apply\(|GeneratorRegistry",
    "VarOrRVar": r"Var", "ExternSignature": r"JITExtern", "ExternCFunction": r"JITExtern", "ImplicitVar": r"\b_\d?\b",
    "ExplainOptions": r"explain_schedule", "ScheduleReport": r"explain_schedule",
    "ScheduleReport::Stage": r"explain_schedule",
    "GradientCheckOptions": r"check_gradients", "GradientReport::Step": r"check_gradients",
    "GradientReport::Method": r"check_gradients", "GradientReport::FuncError": r"check_gradients",
    "StabilityOptions": r"check_stability", "StabilityReport::LeftOut": r"check_stability",
    "AdjointContext::Wanted": r"AdjointContext", "TangentContext": r"custom_tangent|TangentContext", "GradientReport::Input": r"check_gradients",
    "GradientReport": r"check_gradients", "VarOrRVar": r"Var",
    "JacobianOptions": r"jacobian", "Jacobian": r"jacobian|hessian", "HessianDiagonal": r"hessian_diagonal", "Direction": r"propagate_tangents",
    "Tangents": r"propagate_tangents", "ExprCompare": r"ExprCompare", "StringOrLoopLevel": r"set_generator_param_values",
    "AutoScheduleParam": r"auto_schedule", "MachineParams": r"MachineParams|machine_params", "GeneratorContext": r"Generator",
    "AutoSchedulerResults": r"auto_schedule", "InputValue": r"Input<", "StubOutputs": r"stub", "OutputInfo": r"get_output_info",
    "LoweredFunc": r"LoweredFunc|functions\(\)", "ParamMap::Entry": r"ParamMap", "ParamMap::ParamMapping": r"ParamMap|\{\{",
    "Buffer": r"Buffer|realize", "Type": r"type\(|Type|Int\(|Float\(", "CommandLine": r"command_line|run_generators",
    "ScheduleHandle": r"Stage", "LoopDirectives": r"update\(|Func", "Runnable": r"Pipeline|Func", "SmallFloat": r"float16_t", "RealizationArg": r"realize", "ScheduleLog": r"ScheduleLog|schedule_log", "ScheduleLog::Entry": r"ScheduleLog::Entry|entries", "ExternFuncArgument": r"define_extern|ExternFuncArgument", "Module": r"compile_to_module|Module",
    "Tuple": r"Tuple", "Message": r"message\(\)", "Error": r"error", "RVar": r"RDom|RVar", "Expr": r"Expr", "Func": r"Func",
}

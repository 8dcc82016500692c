// generator_base.cpp -- runs the phases of a generator and builds pipelines and modules from it.
#include "generator/generator_base.h"

#include <algorithm>

#include "frontend/run/compiler_interface.h"
#include "ir/equal.h"
#include "ir/scalar.h"

namespace retrograde::internal {

// ---- phases ----

void GeneratorBase::configure_once() {
  if (phase_ != Phase::Created) return;
  phase_ = Phase::Configuring;
  call_configure();
  check_names();
  if (members_.outputs.empty()) {
    user_error("use the generator " + quoted(name_), "it declares at least one Output",
               "it has none", "Add Output<Buffer<>> out{\"out\"}");
  }
  phase_ = Phase::Configured;
}

void GeneratorBase::generate_all() {
  configure_once();
  if (is_generated()) return;
  for (GeneratorInputBase* input : members_.inputs) {
    if (input->values().empty()) input->make_parameters();
  }
  for (GeneratorOutputBase* output : members_.outputs) output->make_funcs();
  call_generate();
  for (GeneratorOutputBase* output : members_.outputs) output->check_defined();
  phase_ = Phase::Generated;
}

void GeneratorBase::schedule_all() {
  generate_all();
  if (phase_ == Phase::Scheduled) return;
  call_schedule();
  phase_ = Phase::Scheduled;
}

void GeneratorBase::check_input_count(size_t count) {
  configure_once();
  if (count == members_.inputs.size()) return;
  user_error("set the inputs of the generator " + quoted(name_), "all are given, in their order",
             text("it has ", members_.inputs.size(), " and was given ", count),
             "Give that many; a std::vector for an array");
}

void GeneratorBase::set_input_values(size_t i, std::vector<InputValue> values) {
  members_.inputs[i]->set_values(std::move(values));
}

void GeneratorBase::check_configuring(const char* role, const std::string& name) const {
  if (phase_ == Phase::Configuring) return;
  user_error(
      "add the " + std::string(role) + " " + quoted(name) + " to the generator " + quoted(name_),
      "inputs and outputs are added in configure()", "this is elsewhere", "Do it there");
}

Expr constant_for_input(const Expr& value, const GeneratorPort& input) {
  if (!input.types_defined() || value.type() == input.type()) return value;
  const std::optional<ir::Scalar> constant = ir::as_scalar(value);
  const ir::Scalar converted = ir::eval_cast(input.type(), *constant);
  if (converted.as_double() != constant->as_double() && !input.type().is_float()) {
    user_error("set the input " + quoted(input.name()) + text(" to ", constant->as_double()),
               "the value fits the input's type", "its type is " + to_string(input.type()),
               "Give a value of that type");
  }
  return ir::to_expr(converted);
}

// ---- the interface AbstractGenerator ----

std::vector<AbstractGenerator::ArgInfo> GeneratorBase::arginfos() {
  configure_once();
  std::vector<ArgInfo> infos;
  const auto add = [&](const GeneratorPort& port, ArgInfoDirection direction) {
    infos.push_back({port.name(), direction, port.kind(),
                     port.types_defined() ? port.types() : std::vector<Type>(),
                     port.dims_defined() ? port.dims() : any_size});
  };
  for (const GeneratorInputBase* input : members_.inputs) add(*input, ArgInfoDirection::Input);
  for (const GeneratorOutputBase* output : members_.outputs) add(*output, ArgInfoDirection::Output);
  return infos;
}

size_t GeneratorBase::find_input(const std::string& name) {
  configure_once();
  const auto found = std::ranges::find_if(
      members_.inputs, [&](const GeneratorInputBase* input) { return input->name() == name; });
  if (found != members_.inputs.end()) return static_cast<size_t>(found - members_.inputs.begin());
  const std::string list = listed(
      members_.inputs, [](const GeneratorInputBase* input) { return quoted(input->name()); });
  user_error("take the input " + quoted(name) + " of the generator " + quoted(name_),
             "an input has the name that the generator declares",
             list.empty() ? "it has none" : "its inputs are " + list, "Name one of these");
}

void GeneratorBase::bind_input(const std::string& name, const std::vector<Parameter>& values) {
  const size_t i = find_input(name);
  GeneratorInputBase& input = *members_.inputs[i];
  input.set_values(ir::mapped(
      values, [&](const Parameter& parameter) { return input.value_of(parameter.contents()); }));
}

void GeneratorBase::bind_input(const std::string& name, const std::vector<Func>& values) {
  set_input(find_input(name), values);
}

void GeneratorBase::bind_input(const std::string& name, const std::vector<Expr>& values) {
  set_input(find_input(name), values);
}

Pipeline GeneratorBase::build_pipeline() {
  schedule_all();
  return get_pipeline();
}

std::vector<Parameter> GeneratorBase::input_parameter(const std::string& name) {
  const GeneratorInputBase& input = *members_.inputs[find_input(name)];
  return ir::mapped(input.values(), [&](const InputValue& value) {
    if (!value.parameter || value.parameter->is_literal) refuse_value_of(input);
    return Parameter(value.parameter);
  });
}

// ---- pipelines and modules ----

Pipeline GeneratorBase::get_pipeline() {
  if (!is_generated()) {
    user_error("take the Pipeline of the generator " + quoted(name_),
               "the Pipeline has the outputs that generate() defines", "generate() has not run",
               "Call it in schedule(), or after apply()");
  }
  if (!pipeline_.defined()) {
    std::vector<Func> funcs;
    for (const GeneratorOutputBase* output : members_.outputs) {
      for (const Func& f : output->funcs()) funcs.push_back(f);
    }
    pipeline_ = Pipeline(funcs);
    add_requirements(pipeline_);
    if (is_traced_) pipeline_.trace_pipeline();
  }
  return pipeline_;
}

void GeneratorBase::use_pipeline(Pipeline pipeline) {
  pipeline_ = std::move(pipeline);
  if (is_traced_) pipeline_.trace_pipeline();
}

void GeneratorBase::trace_pipeline() {
  is_traced_ = true;
  if (pipeline_.defined()) pipeline_.trace_pipeline();
}

std::vector<Func> GeneratorBase::output_funcs(const std::string& name) const {
  std::string list;
  for (const GeneratorOutputBase* output : members_.outputs) {
    if (output->name() == name) return output->funcs();
    list += (list.empty() ? "" : ", ") + quoted(output->name());
  }
  user_error("take the output " + quoted(name) + " of the generator " + quoted(name_),
             "an output has the name that the generator declares", "its outputs are " + list,
             "Name one of these");
}

void GeneratorBase::add_requirements(Pipeline& pipeline) const {
  for (const Requirement& r : requirements_) pipeline.add_requirement(r.condition, r.message);
}

void GeneratorBase::refuse_value_of(const GeneratorInputBase& input) const {
  user_error("compile the generator " + quoted(name_) + " ahead of time",
             "its inputs are those of the compiled function",
             quoted(input.name()) + " was given a value from C++",
             "Take build_module() of a generator without inputs set");
}

std::vector<Argument> GeneratorBase::input_arguments() const {
  std::vector<Argument> arguments;
  for (const GeneratorInputBase* input : members_.inputs) {
    for (const InputValue& value : input->values()) {
      if (!value.parameter || value.parameter->is_literal) refuse_value_of(*input);
      arguments.push_back(frontend::argument_of(*value.parameter));
    }
  }
  return arguments;
}

void GeneratorBase::auto_schedule_pipeline(Pipeline& pipeline) const {
  pipeline.set_autoschedule(autoschedule_options);
  if (!autoscheduler_.name.empty())
    pipeline.apply_autoscheduler(get_target(), autoscheduler_);
  else if (auto_schedule)
    pipeline.auto_schedule(auto_schedule.scheduler(), get_target(), get_machine_params());
}

// Restores the declared names in the metadata; parameters and Funcs may have received other, unique names.
Module GeneratorBase::to_module(Pipeline& pipeline, const std::vector<Argument>& inputs,
                                const std::vector<std::string>& declared_names,
                                const std::string& function_name, LinkageType linkage) {
  const std::string function = function_name.empty() ? name_ : function_name;
  Module module = pipeline.compile_to_module(inputs, function, get_target(), linkage);
  const std::vector<Argument>& compiled = module.functions().back().args;
  const size_t first = compiled.size() - declared_names.size();
  for (size_t i = 0; i < declared_names.size(); i++) {
    if (compiled[first + i].name != declared_names[i])
      module.remap_metadata_name(compiled[first + i].name, declared_names[i]);
  }
  return module;
}

std::vector<std::string> GeneratorBase::input_names() const {
  std::vector<std::string> names;
  for (const GeneratorInputBase* input : members_.inputs) {
    for (size_t i = 0; i < input->values().size(); i++) names.push_back(input->element_name(i));
  }
  return names;
}

Callable GeneratorBase::compile_to_callable(const JITHandlers* handlers,
                                            const std::map<std::string, JITExtern>* externs) {
  schedule_all();
  Pipeline pipeline = get_pipeline();
  auto_schedule_pipeline(pipeline);
  if (handlers) pipeline.jit_handlers() = *handlers;
  if (externs) pipeline.set_jit_externs(*externs);
  return pipeline.compile_to_callable(input_arguments(), get_target().with_feature(Target::JIT));
}

Module GeneratorBase::build_module(const std::string& function_name, LinkageType linkage) {
  schedule_all();
  Pipeline pipeline = get_pipeline();
  auto_schedule_pipeline(pipeline);
  std::vector<std::string> names = input_names();
  for (const GeneratorOutputBase* output : members_.outputs) {
    const std::vector<Func> funcs = output->funcs();
    for (size_t i = 0; i < funcs.size(); i++) {
      const std::string name = output->element_name(i);
      if (funcs[i].outputs() == 1) names.push_back(name);
      for (int k = 0; funcs[i].outputs() > 1 && k < funcs[i].outputs(); k++)
        names.push_back(name + "." + std::to_string(k));
    }
  }
  return to_module(pipeline, input_arguments(), names, function_name, linkage);
}

namespace {

// Text as a C++ string literal, one literal for each line.
std::string quoted_lines(const std::string& text) {
  std::string out;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    out += "\n      " + cpp_literal(text.substr(begin, end - begin) + "\n");
    begin = end + 1;
  }
  return out.empty() ? "\"\"" : out;
}

// "ns::blur" => "ns_blur"
std::string as_identifier(std::string name) {
  for (size_t colons; (colons = name.find("::")) != std::string::npos;)
    name.replace(colons, 2, "_");
  return name;
}

}  // namespace

void GeneratorBase::emit_schedule(const std::string& path, const std::string& function_name) {
  schedule_all();
  Pipeline pipeline = get_pipeline();
  auto_schedule_pipeline(pipeline);
  const std::string function = as_identifier(function_name.empty() ? name_ : function_name);
  const ScheduleLog log = default_compiler().schedule(pipeline.spec(), get_target());
  const std::string guard = "RETROGRADE_SCHEDULE_" + function;
  const std::string header =
      text("// The schedule of the generator ", quoted(name_), " for ", get_target().to_string(),
           ". Made by it; not to be edited.\n#ifndef ", guard, "\n#define ", guard,
           "\n\n#include <retrograde/retrograde.h>\n\n", "inline void apply_schedule_", function,
           "(::retrograde::Pipeline pipeline, ::retrograde::Target) {\n",
           "  pipeline.apply_schedule(::retrograde::ScheduleLog::parse(",
           quoted_lines(log.to_text()), "));\n}\n\n#endif\n");
  default_compiler().write_text(path, header);
}

}  // namespace retrograde::internal

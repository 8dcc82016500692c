// compile_to.cpp -- implements compile_to_*: matches the arguments by name and compiles through a Module.
#include <algorithm>
#include <cctype>
#include <set>

#include "diagnostics/error.h"
#include "frontend/language/func.h"
#include "frontend/run/compiler_interface.h"
#include "frontend/run/pipeline.h"
#include "frontend/run/warnings.h"

namespace retrograde {
namespace {

using ParameterPtr = std::shared_ptr<graph::ParameterContents>;
using Files = std::map<OutputFileType, std::string>;

// The Func's name as a C identifier; names of Funcs may contain other characters.
std::string default_name(const PipelineSpec& pipeline) {
  std::string name = pipeline.name;
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_') c = '_';
  }
  return name;
}

bool is_c_identifier(const std::string& name) {
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0]))) return false;
  return std::ranges::all_of(
      name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; });
}

// Checks the parts between "::", which only mangled names may have.
void check_function_name(const std::string& name, const Target& target) {
  const std::string asked = "compile a pipeline to the function " + quoted(name);
  size_t begin = 0;
  bool has_namespace = false, all_valid = true;
  while (true) {
    const size_t end = name.find("::", begin);
    all_valid = all_valid && is_c_identifier(name.substr(begin, end - begin));
    if (end == std::string::npos) break;
    has_namespace = true;
    begin = end + 2;
  }
  if (!all_valid) {
    user_error(asked, "a function's name is an identifier of C",
               "it has a character that no identifier has there",
               "Use letters, digits and underscores, and a letter first");
  }
  if (has_namespace && !target.has_feature(Target::CPlusPlusMangling)) {
    user_error(asked, "C functions have no namespace", "it has one",
               "Leave it out, or add \"c_plus_plus_mangling\" to the target");
  }
}

ir::LoweredArgument lowered_argument(const Argument& argument, const ParameterPtr& parameter) {
  using Kind = ir::LoweredArgument::Kind;
  ir::LoweredArgument result;
  result.name = argument.name;
  result.kind = argument.is_buffer() ? Kind::InputBuffer : Kind::Scalar;
  result.type = argument.type;
  result.dimensions = argument.dimensions;
  if (parameter) result.symbol = ir::SymbolRef(parameter);
  return result;
}

// The listed arguments in their order, then the Buffers that are embedded in the code.
class Inputs {
 public:
  Inputs(const PipelineSpec& pipeline, const std::vector<Argument>& args, std::string asked)
      : asked_(std::move(asked)), parameters_(graph::parameters_of(pipeline.outputs)) {
    std::set<std::string> names;
    for (const Argument& argument : args) {
      check(argument, names);
      inputs.push_back(lowered_argument(argument, parameter_named(argument.name)));
    }
    for (const ParameterPtr& parameter : parameters_) {
      if (names.count(parameter->name)) continue;
      if (!parameter->is_literal) missing(*parameter);
      inputs.push_back(lowered_argument(frontend::argument_of(*parameter), parameter));
    }
  }
  std::vector<ir::LoweredArgument> inputs;

 private:
  const std::string asked_;
  const std::vector<ParameterPtr> parameters_;

  ParameterPtr parameter_named(const std::string& name) const {
    for (const ParameterPtr& parameter : parameters_) {
      if (parameter->name == name) return parameter;
    }
    return nullptr;  // an argument that the pipeline does not use
  }

  void check(const Argument& argument, std::set<std::string>& names) const {
    if (argument.is_output()) {
      user_error(asked_,
                 "the list of arguments holds inputs, and outputs are appended automatically",
                 quoted(argument.name) + " is an output", "Leave it out");
    }
    if (!names.insert(argument.name).second) {
      user_error(asked_, "every argument is listed once",
                 quoted(argument.name) + " is listed twice", "Leave one of them out");
    }
    const ParameterPtr parameter = parameter_named(argument.name);
    if (!parameter) return;
    if (parameter->is_buffer == argument.is_buffer() && parameter->type == argument.type &&
        parameter->dimensions == argument.dimensions) {
      return;
    }
    user_error(asked_, "an argument agrees with what the pipeline uses under its name",
               "the Argument " + quoted(argument.name) + " differs in kind, type or dimensions",
               "List the Param, ImageParam or Buffer itself");
  }

  [[noreturn]] void missing(const graph::ParameterContents& parameter) const {
    user_error(asked_, "the list of arguments holds every Param and ImageParam that it uses",
               text("it uses the ", parameter.is_buffer ? "ImageParam " : "Param ",
                    quoted(parameter.name), ", which is not listed"),
               "Add " + quoted(parameter.name) + " to the list");
  }
};

Argument user_context_argument() { return {"__user_context", Argument::InputScalar, Handle(), 0}; }

Argument output_argument(const ir::LoweredArgument& lowered) {
  Argument result(lowered.name, Argument::OutputBuffer, lowered.type, lowered.dimensions);
  const auto parameter = std::dynamic_pointer_cast<graph::ParameterContents>(lowered.symbol.lock());
  if (parameter) result.argument_estimates = frontend::argument_of(*parameter).argument_estimates;
  return result;
}

// Estimates of a Func also apply to its output buffer.
void add_estimates(const std::vector<graph::FuncPtr>& outputs, std::vector<Argument>& args) {
  for (Argument& argument : args) {
    if (!argument.is_output() || !argument.argument_estimates.buffer_estimates.empty()) continue;
    for (const graph::FuncPtr& f : outputs) {
      const std::string stem = argument.name.substr(0, argument.name.rfind('.'));
      if (f->name != argument.name && f->name != stem) continue;
      Region region;
      for (const std::string& var : f->args) {
        for (const graph::Bound& bound : f->schedule.estimates) {
          if (bound.var == var && bound.min.defined()) region.push_back({bound.min, bound.extent});
        }
      }
      if (region.size() == f->args.size()) argument.argument_estimates.buffer_estimates = region;
    }
  }
}

}  // namespace

// ---- Pipeline ----

Module Pipeline::module(const std::vector<Argument>& args, const std::string& function_name,
                        const Target& wanted, LinkageType linkage) const {
  const PipelineSpec pipeline = spec();
  const Target target = wanted.without_feature(Target::JIT);
  const std::string name = function_name.empty() ? default_name(pipeline) : function_name;
  check_function_name(name, target);
  Inputs inputs(pipeline, args, "compile the function " + quoted(name));
  internal::LoweredFunc function;
  function.name = name;
  function.linkage = linkage;
  PipelineSpec compiled{name, pipeline.outputs};
  compiled.autoschedule = pipeline.autoschedule;
  function.lowered = default_compiler().lower(compiled, inputs.inputs, pipeline.traced(target));
  if (target.has_feature(Target::UserContext)) function.args.push_back(user_context_argument());
  function.args.insert(function.args.end(), args.begin(), args.end());
  for (const ir::LoweredArgument& argument : function.lowered.args) {
    if (argument.kind == ir::LoweredArgument::Kind::OutputBuffer)
      function.args.push_back(output_argument(argument));
  }
  add_estimates(pipeline.outputs, function.args);
  frontend::tell_warnings(pipeline.outputs, target);
  Module module(name, target);
  module.append(function);
  return module;
}

// ---- files ----

namespace frontend {

Files file_and_header(OutputFileType type, const std::string& prefix, const Target& target) {
  const std::string extension = internal::get_output_info(target).at(type).extension;
  return {{type, prefix + extension}, {OutputFileType::c_header, prefix + ".h"}};
}

void compile_multitarget(OutputFileType type, const std::string& prefix,
                         const std::vector<Target>& targets,
                         const std::vector<std::string>& suffixes, const ModuleFactory& make) {
  const Target& baseline = targets.empty() ? Target("x86-64-linux") : targets.back();
  retrograde::compile_multitarget(prefix.substr(prefix.rfind('/') + 1),
                                  file_and_header(type, prefix, baseline), targets, suffixes, make);
}

}  // namespace frontend

}  // namespace retrograde

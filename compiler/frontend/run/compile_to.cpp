// compile_to.cpp -- Pipeline::compile_to_* and Func::compile_to_*: arguments matched by name, then
// everything goes through a Module.
#include <algorithm>
#include <cctype>
#include <set>

#include "diagnostics/error.h"
#include "frontend/language/func.h"
#include "frontend/run/pipeline.h"
#include "frontend/run/warnings.h"

namespace retrograde {
namespace {

using ParameterPtr = std::shared_ptr<ir::ParameterContents>;
using Files = std::map<OutputFileType, std::string>;

// Names of Funcs may hold what a C identifier cannot.
std::string default_name(const PipelineSpec& pipeline) {
  std::string name = pipeline.name;
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_') c = '_';
  }
  return name;
}

bool is_c_identifier(const std::string& name) {
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0]))) return false;
  return std::all_of(name.begin(), name.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
  });
}

// Parts between "::", which only mangled names may have.
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

// The listed arguments in their order, and then what is to be embedded.
class Inputs {
 public:
  Inputs(const PipelineSpec& pipeline, const std::vector<Argument>& args, std::string asked)
      : asked_(std::move(asked)), parameters_(ir::parameters_of(pipeline.outputs)) {
    std::set<std::string> names;
    for (const Argument& argument : args) {
      check(argument, names);
      inputs.push_back(lowered_argument(argument, parameter_named(argument.name)));
    }
    for (const ParameterPtr& parameter : parameters_) {
      if (names.count(parameter->name)) continue;
      if (!parameter->is_literal) missing(*parameter);
      inputs.push_back(lowered_argument(ir::argument_of(*parameter), parameter));
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
      user_error(asked_, "the list of arguments holds inputs, and outputs follow by themselves",
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
    user_error(asked_, "an argument is what the pipeline uses under its name",
               "the Argument " + quoted(argument.name) + " differs in kind, type or dimensions",
               "List the Param, ImageParam or Buffer itself");
  }

  [[noreturn]] void missing(const ir::ParameterContents& parameter) const {
    user_error(asked_, "the list of arguments holds every Param and ImageParam that it uses",
               text("it uses the ", parameter.is_buffer ? "ImageParam " : "Param ",
                    quoted(parameter.name), ", which is not listed"),
               "Add " + quoted(parameter.name) + " to the list");
  }
};

Argument user_context_argument() { return {"__user_context", Argument::InputScalar, Handle(), 0}; }

Argument output_argument(const ir::LoweredArgument& lowered) {
  Argument result(lowered.name, Argument::OutputBuffer, lowered.type, lowered.dimensions);
  const auto parameter = std::dynamic_pointer_cast<ir::ParameterContents>(lowered.symbol.lock());
  if (parameter) result.argument_estimates = ir::argument_of(*parameter).argument_estimates;
  return result;
}

// Estimates given to the Func serve its output buffer.
void add_estimates(const std::vector<ir::FuncPtr>& outputs, std::vector<Argument>& args) {
  for (Argument& argument : args) {
    if (!argument.is_output() || !argument.argument_estimates.buffer_estimates.empty()) continue;
    for (const ir::FuncPtr& f : outputs) {
      const std::string stem = argument.name.substr(0, argument.name.rfind('.'));
      if (f->name != argument.name && f->name != stem) continue;
      Region region;
      for (const std::string& var : f->args) {
        for (const ir::Bound& bound : f->schedule.estimates) {
          if (bound.var == var && bound.min.defined()) region.push_back({bound.min, bound.extent});
        }
      }
      if (region.size() == f->args.size()) argument.argument_estimates.buffer_estimates = region;
    }
  }
}

}  // namespace

// ---- Pipeline ----

Module Pipeline::compile_to_module(const std::vector<Argument>& args,
                                   const std::string& function_name, const Target& wanted,
                                   LinkageType linkage) {
  const PipelineSpec pipeline = spec();
  const Target target = wanted.without_feature(Target::JIT);
  const std::string name = function_name.empty() ? default_name(pipeline) : function_name;
  check_function_name(name, target);
  Inputs inputs(pipeline, args, "compile the function " + quoted(name));
  internal::LoweredFunc function;
  function.name = name;
  function.linkage = linkage;
  function.lowered =
      module_compiler().lower({name, pipeline.outputs}, inputs.inputs, pipeline.traced(target));
  if (target.has_feature(Target::UserContext)) function.args.push_back(user_context_argument());
  function.args.insert(function.args.end(), args.begin(), args.end());
  for (const ir::LoweredArgument& argument : function.lowered.args) {
    if (argument.kind == ir::LoweredArgument::Kind::OutputBuffer)
      function.args.push_back(output_argument(argument));
  }
  add_estimates(pipeline.outputs, function.args);
  ir::tell_warnings(pipeline.outputs);
  Module module(name, target);
  module.append(function);
  return module;
}

void Pipeline::compile_to(const Files& output_files, const std::vector<Argument>& args,
                          const std::string& function_name, const Target& target) {
  compile_to_module(args, function_name, target).compile(output_files);
}

void Pipeline::compile_to_object(const std::string& filename, const std::vector<Argument>& args,
                                 const std::string& function_name, const Target& target) {
  compile_to({{OutputFileType::object, filename}}, args, function_name, target);
}

void Pipeline::compile_to_bitcode(const std::string& filename, const std::vector<Argument>& args,
                                  const std::string& function_name, const Target& target) {
  compile_to({{OutputFileType::bitcode, filename}}, args, function_name, target);
}

void Pipeline::compile_to_llvm_assembly(const std::string& filename,
                                        const std::vector<Argument>& args,
                                        const std::string& function_name, const Target& target) {
  compile_to({{OutputFileType::llvm_assembly, filename}}, args, function_name, target);
}

void Pipeline::compile_to_assembly(const std::string& filename, const std::vector<Argument>& args,
                                   const std::string& function_name, const Target& target) {
  compile_to({{OutputFileType::assembly, filename}}, args, function_name, target);
}

void Pipeline::compile_to_header(const std::string& filename, const std::vector<Argument>& args,
                                 const std::string& function_name, const Target& target) {
  compile_to({{OutputFileType::c_header, filename}}, args, function_name, target);
}

void Pipeline::compile_to_c(const std::string& filename, const std::vector<Argument>& args,
                            const std::string& function_name, const Target& target) {
  compile_to({{OutputFileType::c_source, filename}}, args, function_name, target);
}

void Pipeline::compile_to_lowered_stmt(const std::string& filename,
                                       const std::vector<Argument>& args, StmtOutputFormat format,
                                       const Target& target) {
  const OutputFileType type = format == HTML ? OutputFileType::stmt_html : OutputFileType::stmt;
  compile_to({{type, filename}}, args, "", target);
}

void Pipeline::compile_to_file(const std::string& filename_prefix,
                               const std::vector<Argument>& args, const std::string& function_name,
                               const Target& target) {
  const auto info = internal::get_output_info(target);
  compile_to({{OutputFileType::object, filename_prefix + info.at(OutputFileType::object).extension},
              {OutputFileType::c_header, filename_prefix + ".h"}},
             args, function_name, target);
}

void Pipeline::compile_to_static_library(const std::string& filename_prefix,
                                         const std::vector<Argument>& args,
                                         const std::string& function_name, const Target& target) {
  const auto info = internal::get_output_info(target);
  compile_to({{OutputFileType::static_library,
               filename_prefix + info.at(OutputFileType::static_library).extension},
              {OutputFileType::c_header, filename_prefix + ".h"}},
             args, function_name, target);
}

// Like Halide's: the function is called as the last part of the prefix.
static std::string name_in_prefix(const std::string& filename_prefix) {
  return filename_prefix.substr(filename_prefix.rfind('/') + 1);
}

void Pipeline::compile_to_multitarget_static_library(const std::string& filename_prefix,
                                                     const std::vector<Argument>& args,
                                                     const std::vector<Target>& targets) {
  const auto make = [&](const std::string& name, const Target& target) {
    return compile_to_module(args, name, target);
  };
  const std::string extension =
      targets.empty()
          ? ".a"
          : internal::get_output_info(targets.back()).at(OutputFileType::static_library).extension;
  compile_multitarget(name_in_prefix(filename_prefix),
                      {{OutputFileType::static_library, filename_prefix + extension},
                       {OutputFileType::c_header, filename_prefix + ".h"}},
                      targets, {}, make);
}

void Pipeline::compile_to_multitarget_object_files(const std::string& filename_prefix,
                                                   const std::vector<Argument>& args,
                                                   const std::vector<Target>& targets,
                                                   const std::vector<std::string>& suffixes) {
  const auto make = [&](const std::string& name, const Target& target) {
    return compile_to_module(args, name, target);
  };
  const std::string extension =
      targets.empty()
          ? ".o"
          : internal::get_output_info(targets.back()).at(OutputFileType::object).extension;
  compile_multitarget(name_in_prefix(filename_prefix),
                      {{OutputFileType::object, filename_prefix + extension},
                       {OutputFileType::c_header, filename_prefix + ".h"}},
                      targets, suffixes, make);
}

// ---- Func ----

Module Func::compile_to_module(const std::vector<Argument>& args, const std::string& function_name,
                               const Target& target) {
  return pipeline().compile_to_module(args, function_name, target);
}

void Func::compile_to(const Files& output_files, const std::vector<Argument>& args,
                      const std::string& function_name, const Target& target) {
  pipeline().compile_to(output_files, args, function_name, target);
}

// The functions that come with and without a function name.
#define RETROGRADE_FORWARD(function)                                                  \
  void Func::function(const std::string& filename, const std::vector<Argument>& args, \
                      const std::string& function_name, const Target& target) {       \
    pipeline().function(filename, args, function_name, target);                       \
  }                                                                                   \
  void Func::function(const std::string& filename, const std::vector<Argument>& args, \
                      const Target& target) {                                         \
    pipeline().function(filename, args, "", target);                                  \
  }
RETROGRADE_FORWARD(compile_to_object)
RETROGRADE_FORWARD(compile_to_bitcode)
RETROGRADE_FORWARD(compile_to_llvm_assembly)
RETROGRADE_FORWARD(compile_to_assembly)
#undef RETROGRADE_FORWARD

void Func::compile_to_header(const std::string& filename, const std::vector<Argument>& args,
                             const std::string& function_name, const Target& target) {
  pipeline().compile_to_header(filename, args, function_name, target);
}

void Func::compile_to_c(const std::string& filename, const std::vector<Argument>& args,
                        const std::string& function_name, const Target& target) {
  pipeline().compile_to_c(filename, args, function_name, target);
}

void Func::compile_to_lowered_stmt(const std::string& filename, const std::vector<Argument>& args,
                                   StmtOutputFormat format, const Target& target) {
  pipeline().compile_to_lowered_stmt(filename, args, format, target);
}

void Func::compile_to_file(const std::string& filename_prefix, const std::vector<Argument>& args,
                           const std::string& function_name, const Target& target) {
  pipeline().compile_to_file(filename_prefix, args, function_name, target);
}

void Func::compile_to_static_library(const std::string& filename_prefix,
                                     const std::vector<Argument>& args,
                                     const std::string& function_name, const Target& target) {
  pipeline().compile_to_static_library(filename_prefix, args, function_name, target);
}

void Func::compile_to_multitarget_static_library(const std::string& filename_prefix,
                                                 const std::vector<Argument>& args,
                                                 const std::vector<Target>& targets) {
  pipeline().compile_to_multitarget_static_library(filename_prefix, args, targets);
}

void Func::compile_to_multitarget_object_files(const std::string& filename_prefix,
                                               const std::vector<Argument>& args,
                                               const std::vector<Target>& targets,
                                               const std::vector<std::string>& suffixes) {
  pipeline().compile_to_multitarget_object_files(filename_prefix, args, targets, suffixes);
}

}  // namespace retrograde

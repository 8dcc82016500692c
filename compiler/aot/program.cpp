#include "aot/program.h"

#include <HalideRuntime.h>

#include <algorithm>

#include "aot/mangle.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/scalar.h"

namespace retrograde::aot {
namespace {

using codegen::ExportArgument;
using codegen::Signature;

// Feature masks use Halide's bit positions.
static_assert(static_cast<int>(Target::AVX512_SapphireRapids) ==
              static_cast<int>(halide_target_feature_avx512_sapphirerapids));
static_assert(static_cast<int>(Target::ProfileByTimer) ==
              static_cast<int>(halide_target_feature_profile_by_timer));

// Metadata only contains limits that are constants.
std::optional<ir::Scalar> constant_of(const Expr& e, Type type) {
  if (!e.defined() || type.is_handle()) return std::nullopt;
  const std::optional<ir::Scalar> value = ir::as_scalar(e);
  if (!value) return std::nullopt;
  return ir::eval_cast(type, *value);
}

std::vector<std::pair<int64_t, int64_t>> constant_region(const Region& region) {
  std::vector<std::pair<int64_t, int64_t>> result;
  for (const Range& range : region) {
    const auto min = ir::as_const_int(range.min), extent = ir::as_const_int(range.extent);
    if (!min || !extent) return {};
    result.emplace_back(*min, *extent);
  }
  return result;
}

ExportArgument export_argument(const Argument& argument,
                               const std::map<std::string, std::string>& names) {
  const ArgumentEstimates& known = argument.argument_estimates;
  ExportArgument result;
  result.name = ir::value_or(names, argument.name, argument.name);
  result.kind = static_cast<ExportArgument::Kind>(argument.kind);
  result.type = argument.type;
  result.dimensions = argument.dimensions;
  result.def = constant_of(known.scalar_def, argument.type);
  result.min = constant_of(known.scalar_min, argument.type);
  result.max = constant_of(known.scalar_max, argument.type);
  result.estimate = constant_of(known.scalar_estimate, argument.type);
  result.buffer_estimates = constant_region(known.buffer_estimates);
  return result;
}

void set_symbols(Signature& signature, const std::string& name, const Target& target,
                 LinkageType linkage) {
  const bool is_cpp = target.has_feature(Target::CPlusPlusMangling);
  const bool has_metadata = linkage == LinkageType::ExternalPlusMetadata;
  const bool has_argv = has_metadata || linkage == LinkageType::ExternalPlusArgv;
  const std::string argv = name + "_argv", metadata = name + "_metadata";
  signature.name = is_cpp ? mangled(name, signature.arguments) : name;
  if (has_argv) signature.argv_name = is_cpp ? mangled_argv(argv) : argv;
  if (has_metadata) signature.metadata_name = is_cpp ? mangled_metadata(metadata) : metadata;
  signature.metadata_title = name_parts(name).back();
  signature.target = target.to_string();
  signature.user_context = target.has_feature(Target::UserContext);
}

const halide_buffer_t* embedded_buffer(const ir::LoweredArgument& argument,
                                       const std::string& function) {
  const auto parameter =
      std::dynamic_pointer_cast<graph::ParameterContents>(argument.symbol.lock());
  if (parameter && parameter->is_literal && parameter->buffer && parameter->buffer->host)
    return parameter->buffer;
  user_error("compile the function " + quoted(function),
             "a Buffer that is not an argument has data", quoted(argument.name) + " has none",
             "Give it data, or add it to the list of arguments");
}

codegen::Export export_of(const internal::LoweredFunc& function, const Module& module,
                          size_t index) {
  codegen::Export result;
  result.function = index;
  result.signature = signature_of(function, module);
  for (const ir::LoweredArgument& argument : function.lowered.args) {
    const auto found = std::ranges::find(function.args, argument.name, &Argument::name);
    codegen::Source source;
    if (found == function.args.end()) {
      source.embedded = embedded_buffer(argument, function.name);
    } else {
      source.argument = static_cast<int>(found - function.args.begin());
    }
    result.sources.push_back(source);
  }
  return result;
}

// Collects the functions of `module`, which is `root` or one of its submodules.
void collect(const Module& module, const Module& root,
             std::vector<std::pair<internal::LoweredFunc, Module>>& found) {
  const std::string asked = "compile the module " + quoted(root.name());
  for (const internal::LoweredFunc& function : module.functions()) {
    if (function.linkage == LinkageType::Internal) continue;
    for (const auto& [other, where] : found) {
      if (other.name != function.name) continue;
      user_error(asked, "functions of a module and its submodules have different names",
                 "two are called " + quoted(function.name), "Rename one of them");
    }
    found.emplace_back(function, module);
  }
  for (const Module& submodule : module.submodules()) {
    if (submodule.target() == module.target()) {
      collect(submodule, root, found);
      continue;
    }
    unsupported(asked, "a module and its submodules are made for one target",
                quoted(submodule.name()) + " is for " + quoted(submodule.target().to_string()),
                "Compile it by itself");
  }
}

std::vector<uint64_t> feature_mask(const Target& target) {
  std::vector<uint64_t> words((halide_target_feature_end + 63) / 64);
  for (int f = 0; f < halide_target_feature_end; f++) {
    if (target.has_feature(static_cast<Target::Feature>(f)))
      words[static_cast<size_t>(f) / 64] |= uint64_t{1} << f % 64;
  }
  return words;
}

}  // namespace

std::vector<internal::LoweredFunc> exported_functions(const Module& module) {
  std::vector<std::pair<internal::LoweredFunc, Module>> found;
  collect(module, module, found);
  std::vector<internal::LoweredFunc> functions;
  for (auto& [function, where] : found) functions.push_back(std::move(function));
  return functions;
}

Signature signature_of(const internal::LoweredFunc& function, const Module& module) {
  Signature signature;
  for (const Argument& argument : function.args)
    signature.arguments.push_back(export_argument(argument, module.get_metadata_name_map()));
  set_symbols(signature, function.name, module.target(), function.linkage);
  return signature;
}

codegen::Program program_of(const Module& module) {
  std::vector<std::pair<internal::LoweredFunc, Module>> found;
  collect(module, module, found);
  codegen::Program program;
  for (const auto& [function, where] : found) {
    program.exports.push_back(export_of(function, where, program.functions.size()));
    program.functions.push_back(function.lowered);
    program.functions.back().name = name_parts(function.name).back() + ".pipeline";
  }
  return program;
}

Signature dispatcher_signature(const std::string& function_name, const Module& baseline) {
  RETROGRADE_ASSERT(baseline.functions().size() == 1, "a variant has one function");
  const internal::LoweredFunc& function = baseline.functions()[0];
  Signature signature = signature_of(function, baseline);
  set_symbols(signature, function_name, baseline.target(), function.linkage);
  return signature;
}

codegen::Program dispatcher(const std::string& function_name, const std::vector<Module>& modules) {
  codegen::Dispatch dispatch;
  dispatch.signature = dispatcher_signature(function_name, modules.back());
  for (const Module& module : modules) {
    dispatch.variants.push_back(
        {signature_of(module.functions().at(0), module).name, feature_mask(module.target())});
  }
  codegen::Program program;
  program.dispatches.push_back(std::move(dispatch));
  return program;
}

}  // namespace retrograde::aot

#include "aot/header.h"

#include <cctype>

#include "aot/mangle.h"
#include "diagnostics/error.h"

namespace retrograde::aot {

std::string identifier(const std::string& text) {
  std::string result;
  for (char c : text) result += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return result;
}

std::string in_namespaces(const std::string& name, const std::string& text) {
  std::vector<std::string> parts = name_parts(name);
  parts.pop_back();
  std::string begin, end;
  for (const std::string& part : parts) {
    begin += "namespace " + part + " {\n";
    end = "}  // namespace " + part + "\n" + end;
  }
  return begin + text + end;
}

namespace {

std::string parameter_name(const codegen::ExportArgument& argument) {
  if (argument.name == "__user_context") return argument.name;
  return "_" + identifier(argument.name) + (argument.is_buffer() ? "_buffer" : "");
}

std::string with_space(const std::string& type) { return type.back() == '*' ? type : type + " "; }

std::string parameters(const codegen::Signature& signature) {
  std::string text;
  for (const codegen::ExportArgument& argument : signature.arguments) {
    if (!text.empty()) text += ", ";
    text += with_space(c_type(argument)) + parameter_name(argument);
  }
  return text;
}

// Describes only facts: type and dimensions. The meaning of an argument would be a guess.
std::string description(const codegen::ExportArgument& argument) {
  if (argument.name == "__user_context") return "handed to the functions of HalideRuntime.h";
  const char* const kinds[] = {"scalar", "input", "output"};
  std::string text =
      std::string(kinds[static_cast<int>(argument.kind)]) + " of " + to_string(argument.type);
  if (argument.is_buffer()) text += ", " + std::to_string(argument.dimensions) + " dimensions";
  return text;
}

std::string declaration(const DeclaredFunction& function) {
  const codegen::Signature& signature = function.signature;
  const std::string name = name_parts(function.name).back();
  std::string text;
  for (const codegen::ExportArgument& argument : signature.arguments)
    text += "// " + parameter_name(argument) + ": " + description(argument) + "\n";
  text += "HALIDE_FUNCTION_ATTRS\nint " + name + "(" + parameters(signature) + ");\n\n";
  if (!signature.argv_name.empty())
    text += "HALIDE_FUNCTION_ATTRS\nint " + name + "_argv(void **args);\n\n";
  if (!signature.metadata_name.empty()) {
    text += "HALIDE_FUNCTION_ATTRS\nconst struct halide_filter_metadata_t *" + name +
            "_metadata();\n\n";
  }
  return text;
}

const char* const preamble = R"(#include <stdint.h>
#ifndef __cplusplus
#include <stdbool.h>
#endif

#if defined(__has_include)
#if __has_include("HalideRuntime.h")
#include "HalideRuntime.h"
#endif
#endif

// Attributes of the functions below, such as a calling convention.
#ifndef HALIDE_FUNCTION_ATTRS
#define HALIDE_FUNCTION_ATTRS
#endif

struct halide_buffer_t;
struct halide_filter_metadata_t;

// Each function returns 0 on success. On an error it calls halide_error and then returns a code of HalideRuntime.h. By
// default halide_error prints the message and aborts; halide_set_error_handler replaces it. If any buffer has neither
// host nor device memory, the call is a bounds query: it computes nothing and fills in the bounds of such buffers.

)";

}  // namespace

std::string header_text(const std::string& module_name, const Target& target,
                        const std::vector<DeclaredFunction>& functions) {
  const std::string guard = "RETROGRADE_MODULE_" + identifier(module_name) + "_H";
  const bool is_cpp = target.has_feature(Target::CPlusPlusMangling);
  std::string text = "// " + module_name + ": functions compiled for " + target.to_string() + "\n";
  text += "#ifndef " + guard + "\n#define " + guard + "\n\n" + preamble;
  if (!is_cpp) text += "#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n";
  for (const DeclaredFunction& function : functions)
    text += is_cpp ? in_namespaces(function.name, declaration(function)) : declaration(function);
  if (!is_cpp) text += "#ifdef __cplusplus\n}\n#endif\n\n";
  return text + "#endif\n";
}

std::string registration_text(const std::vector<DeclaredFunction>& functions,
                              const Target& target) {
  const bool is_cpp = target.has_feature(Target::CPlusPlusMangling);
  std::string text =
      "// Compile this into a program that defines halide_register_argv_and_metadata.\n"
      "struct halide_filter_metadata_t;\n\n"
      "extern \"C\" void halide_register_argv_and_metadata(\n"
      "    int (*filter_argv_call)(void **), const struct halide_filter_metadata_t *,\n"
      "    const char *const *extra_key_value_pairs);\n\n"
      "#ifndef HALIDE_REGISTER_EXTRA_KEY_VALUE_PAIRS_FUNC\n"
      "#define HALIDE_REGISTER_EXTRA_KEY_VALUE_PAIRS_FUNC retrograde_no_extra_pairs\n"
      "static const char *const *retrograde_no_extra_pairs() { return nullptr; }\n"
      "#else\n"
      "extern \"C\" const char *const *HALIDE_REGISTER_EXTRA_KEY_VALUE_PAIRS_FUNC();\n"
      "#endif\n\n";
  for (const DeclaredFunction& function : functions) {
    if (function.signature.metadata_name.empty()) continue;
    const std::string name = name_parts(function.name).back();
    const std::string declarations =
        "int " + name + "_argv(void **args);\nconst struct halide_filter_metadata_t *" + name +
        "_metadata();\n";
    text += is_cpp ? in_namespaces(function.name, declarations)
                   : "extern \"C\" {\n" + declarations + "}\n";
    text += "namespace {\nconst struct Register_" + identifier(function.name) + " {\n  Register_" +
            identifier(function.name) + "() {\n    halide_register_argv_and_metadata(" +
            function.name + "_argv, " + function.name +
            "_metadata(),\n                                      "
            "HALIDE_REGISTER_EXTRA_KEY_VALUE_PAIRS_FUNC());\n  }\n} register_" +
            identifier(function.name) + ";\n}  // namespace\n\n";
  }
  return text;
}

}  // namespace retrograde::aot

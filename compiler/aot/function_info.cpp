// function_info.cpp -- generates a constexpr function for each compiled one:
//
//   inline constexpr std::array<::HalideFunctionInfo::ArgumentInfo, 2> blur_argument_info() {
//     return {{
//         {"in", ::HalideFunctionInfo::InputBuffer, 2, halide_type_t(halide_type_float, 32)},
//         {"out", ::HalideFunctionInfo::OutputBuffer, 2, halide_type_t(halide_type_float, 32)},
//     }};
//   }
#include "aot/function_info.h"

#include "aot/mangle.h"
#include "diagnostics/error.h"

namespace retrograde::aot {
namespace {

// Recent HalideRuntime.h files declare these types and also define their version. For older ones, the generated text
// declares them through a using-directive, so that any declarations in the namespace itself take precedence.
const char* const info_preamble =
    R"(#if __cplusplus < 201703L && !(defined(_MSVC_LANG) && _MSVC_LANG >= 201703L)
#error "function_info headers need C++17"
#endif

#include <array>
#include <cstdint>
#include <string_view>

#include "HalideRuntime.h"

#if !defined(HALIDE_VERSION_MAJOR) && !defined(RETROGRADE_FUNCTION_INFO)
#define RETROGRADE_FUNCTION_INFO
namespace retrograde_function_info {
enum ArgumentKind { InputScalar = 0, InputBuffer = 1, OutputBuffer = 2 };
struct ArgumentInfo {
  std::string_view name;
  ArgumentKind kind;
  int32_t dimensions;  // 0 for scalars
  halide_type_t type;
};
}  // namespace retrograde_function_info
namespace HalideFunctionInfo {
using namespace retrograde_function_info;
}  // namespace HalideFunctionInfo
#endif

)";

std::string quoted_name(const std::string& name) {
  std::string result;
  for (char c : name) result += c == '"' || c == '\\' ? std::string{'\\', c} : std::string{c};
  return "\"" + result + "\"";
}

std::string info_type(const Type& type) {
  const char* const code = type.is_handle()   ? "handle"
                           : type.is_bfloat() ? "bfloat"
                           : type.is_float()  ? "float"
                           : type.is_int()    ? "int"
                                              : "uint";
  return text("halide_type_t(halide_type_", code, ", ", type.bits(), ")");
}

std::string info_row(const codegen::ExportArgument& argument) {
  const char* const kinds[] = {"InputScalar", "InputBuffer", "OutputBuffer"};
  return text("      {", quoted_name(argument.name),
              ", ::HalideFunctionInfo::", kinds[static_cast<int>(argument.kind)], ", ",
              argument.dimensions, ", ", info_type(argument.type), "},\n");
}

std::string info_function(const DeclaredFunction& function) {
  const std::vector<codegen::ExportArgument>& arguments = function.signature.arguments;
  std::string rows;
  for (const codegen::ExportArgument& argument : arguments) rows += info_row(argument);
  return text("inline constexpr std::array<::HalideFunctionInfo::ArgumentInfo, ", arguments.size(),
              "> ", name_parts(function.name).back(), "_argument_info() {\n  return {{\n", rows,
              "  }};\n}\n");
}

}  // namespace

std::string function_info_text(const std::string& module_name, const Target& target,
                               const std::vector<DeclaredFunction>& functions) {
  const std::string guard = "RETROGRADE_INFO_" + identifier(module_name) + "_H";
  std::string result = "// " + module_name + ": arguments of functions compiled for " +
                       target.to_string() + "\n#ifndef " + guard + "\n#define " + guard + "\n\n" +
                       info_preamble;
  for (const DeclaredFunction& function : functions)
    result += in_namespaces(function.name, info_function(function)) + "\n";
  return result + "#endif\n";
}

}  // namespace retrograde::aot

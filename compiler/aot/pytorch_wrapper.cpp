// pytorch_wrapper.cpp -- see pytorch_wrapper.h. Inserts the parts that depend on the function's arguments into fixed
// texts.
#include "aot/pytorch_wrapper.h"

#include "aot/mangle.h"
#include "aot/pytorch_function.h"
#include "aot/pytorch_operator.h"
#include "aot/pytorch_text.h"
#include "diagnostics/error.h"

namespace retrograde::aot {
namespace {

std::string wrapper(const TorchFunction& function) {
  std::string views, call = function.user_context ? "nullptr" : "", parameters;
  if (function.on_device && !function.images.empty()) {
    views = "  const retrograde_torch::OnDevice on_device(\"" + function.name + "\", " +
            cpp_identifier(function.images[0].name) + ");\n";
  }
  const auto add = [&](const ExportArgument& argument) {
    const std::string name = cpp_identifier(argument.name);
    const bool is_output = argument.kind == ExportArgument::Kind::OutputBuffer;
    parameters += (parameters.empty() ? "" : ", ") +
                  (is_output ? "at::Tensor& " + name : parameter(argument));
    call += call.empty() ? "" : ", ";
    if (!argument.is_buffer()) {
      call += "static_cast<" + c_type(argument) + ">(" + name + ")";
      return;
    }
    views += text("  retrograde_torch::", function.on_device ? "Device" : "", "View<",
                  argument.dimensions, "> view_of_", name, "(\"", function.name, "\", \"",
                  argument.name, "\", ", name, ", ", element_type(argument), ", ",
                  scalar_type(argument), ", ", is_output ? "true" : "false", ");\n");
    call += "&view_of_" + name + ".raw";
  };
  for (const ExportArgument& argument : function.inputs) add(argument);
  for (const ExportArgument& argument : function.outputs) add(argument);
  return filled(
      R"(
// Returns the function's code: 0 or an error code. Throws c10::Error for unsuitable tensors.
inline int $name$_th_($parameters$) {
$views$  return ::$name$($call$);
}
)",
      {{"name", function.name}, {"parameters", parameters}, {"views", views}, {"call", call}});
}

}  // namespace

std::string pytorch_wrapper_text(const std::string& module_name, const Target& target,
                                 const std::vector<DeclaredFunction>& functions) {
  const std::string guard = "RETROGRADE_PYTORCH_" + cpp_identifier(module_name) + "_H";
  std::string result =
      "// " + module_name +
      ": its functions on tensors of PyTorch, and their registration as an operator.\n#ifndef " +
      guard + "\n#define " + guard +
      "\n\n#include <ATen/ATen.h>\n#include <HalideRuntime.h>\n\n#include <stdexcept>\n"
      "#include <string>\n#include <tuple>\n#include <vector>\n\n#include \"" +
      cpp_identifier(module_name) + ".h\"\n" + pytorch_helpers;
  if (target.has_gpu_feature()) result += pytorch_device_helpers;
  for (const DeclaredFunction& declared : functions) {
    const TorchFunction function = torch_function_of(declared, target);
    result += wrapper(function);
    if (!function.images.empty()) result += torch_operator_text(function);
  }
  return result + "\n#endif\n";
}

}  // namespace retrograde::aot

// pytorch_function.cpp -- see pytorch_function.h.
#include "aot/pytorch_function.h"

#include <cctype>

#include "aot/mangle.h"
#include "diagnostics/error.h"
#include "ir/print.h"

namespace retrograde::aot {

std::string cpp_identifier(const std::string& name) {
  std::string result;
  for (char c : name) result += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return result;
}

std::string filled(std::string text, const TextValues& values) {
  for (const auto& [name, value] : values) {
    const std::string place = "$" + name + "$";
    for (size_t at = text.find(place); at != std::string::npos;
         at = text.find(place, at + value.size()))
      text.replace(at, place.size(), value);
  }
  return text;
}

std::string scalar_type(const ExportArgument& argument) {
  const Type type = argument.type;
  const std::string bits = std::to_string(type.bits());
  if (type.is_bool()) return "at::kBool";
  if (type.is_bfloat()) return "at::kBFloat16";
  if (type.is_float())
    return type.bits() == 16 ? "at::kHalf" : type.bits() == 32 ? "at::kFloat" : "at::kDouble";
  if (type.is_int())
    return type.bits() == 8    ? "at::kChar"
           : type.bits() == 16 ? "at::kShort"
           : type.bits() == 32 ? "at::kInt"
                               : "at::kLong";
  if (type.is_uint() && type.bits() == 8) return "at::kByte";
  unsupported("write a wrapper for PyTorch", "PyTorch supports the types of all arguments",
              quoted(argument.name) + " holds " + to_string(type), "Use another element type");
}

std::string element_type(const ExportArgument& argument) {
  const Type type = argument.type;
  const char* const code = type.is_bfloat()  ? "halide_type_bfloat"
                           : type.is_float() ? "halide_type_float"
                           : type.is_int()   ? "halide_type_int"
                                             : "halide_type_uint";
  return text("halide_type_t(", code, ", ", type.bits(), ")");
}

std::string number_type(const ExportArgument& argument) {
  return argument.type.is_bool() ? "bool" : argument.type.is_float() ? "double" : "int64_t";
}

TorchFunction torch_function_of(const DeclaredFunction& declared, const Target& target) {
  TorchFunction function{
      declared.name, declared.signature.user_context, target.has_gpu_feature(), {}, {}, {}};
  if (name_parts(declared.name).size() > 1) {
    unsupported("write a wrapper for PyTorch of " + quoted(declared.name),
                "the function's name is a C name", "it is in a namespace",
                "Leave the namespace out");
  }
  for (const ExportArgument& argument : declared.signature.arguments) {
    if (argument.name == "__user_context") continue;
    scalar_type(argument);
    (argument.kind == ExportArgument::Kind::OutputBuffer ? function.outputs : function.inputs)
        .push_back(argument);
    if (argument.kind == ExportArgument::Kind::InputBuffer) function.images.push_back(argument);
  }
  return function;
}

std::string listed(const std::vector<ExportArgument>& arguments,
                   const std::function<std::string(const ExportArgument&)>& each) {
  return joined(ir::mapped(arguments, each));
}

std::string parameter(const ExportArgument& argument) {
  return (argument.is_buffer() ? "const at::Tensor& " : number_type(argument) + " ") +
         cpp_identifier(argument.name);
}

std::string name_of(const ExportArgument& argument) { return cpp_identifier(argument.name); }

std::string joined(const std::vector<std::string>& parts, const std::string& between) {
  std::string result;
  for (const std::string& part : parts) result += (result.empty() ? "" : between) + part;
  return result;
}

}  // namespace retrograde::aot

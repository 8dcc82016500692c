// pytorch_function.h -- a compiled function as C++ source on tensors: what wrappers and operators share.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "aot/header.h"

namespace retrograde::aot {

using codegen::ExportArgument;

struct TorchFunction {
  std::string name;  // the C++ name
  bool user_context = false;
  bool on_device = false;                               // whether its tensors are in GPU memory
  std::vector<ExportArgument> inputs, outputs, images;  // images: the inputs that are buffers
};

// Requires: PyTorch supports the types of all arguments (Unsupported); the function's name is a C name (Unsupported).
TorchFunction torch_function_of(const DeclaredFunction& declared, const Target& target);

// The argument's name as a C++ identifier.
std::string cpp_identifier(const std::string& name);
std::string name_of(const ExportArgument& argument);
// The tensor's element type: at::kFloat.
std::string scalar_type(const ExportArgument& argument);
std::string element_type(const ExportArgument& argument);  // a halide_type_t
std::string number_type(const ExportArgument& argument);   // double, int64_t, bool
std::string parameter(const ExportArgument& argument);     // const at::Tensor& image, double gain

std::string listed(const std::vector<ExportArgument>& arguments,
                   const std::function<std::string(const ExportArgument&)>& each);
std::string joined(const std::vector<std::string>& parts, const std::string& between = ", ");

// Values for the placeholders "$name$" in a text.
using TextValues = std::map<std::string, std::string>;
std::string filled(std::string text, const TextValues& values);

}  // namespace retrograde::aot

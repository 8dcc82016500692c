// pytorch_function.h -- a compiled function as C++ that knows tensors writes it: what wrappers and operators share.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "aot/header.h"

namespace retrograde::aot {

using codegen::ExportArgument;

struct TorchFunction {
  std::string name;  // as C++ calls it
  bool user_context = false;
  bool on_device = false;                               // its tensors are a GPU's
  std::vector<ExportArgument> inputs, outputs, images;  // images: those of the inputs
};

// Requires: what PyTorch calls has tensors and numbers that PyTorch has (Unsupported); what PyTorch
// calls has a name of C (Unsupported).
TorchFunction torch_function_of(const DeclaredFunction& declared, const Target& target);

// A name as C++ writes it.
std::string word(const std::string& name);
std::string name_of(const ExportArgument& argument);
// The tensors' name of an element type: at::kFloat.
std::string scalar_type(const ExportArgument& argument);
std::string element_type(const ExportArgument& argument);  // a halide_type_t
std::string number_type(const ExportArgument& argument);   // double, int64_t, bool
std::string parameter(const ExportArgument& argument);     // const at::Tensor& image, double gain

std::string listed(const std::vector<ExportArgument>& arguments,
                   const std::function<std::string(const ExportArgument&)>& each);
std::string joined(const std::vector<std::string>& parts, const std::string& between = ", ");

// "$name$" in a text stands for a value.
using TextValues = std::map<std::string, std::string>;
std::string filled(std::string text, const TextValues& values);

}  // namespace retrograde::aot

// Compiled functions on tensors of PyTorch, and the operator of it.
#pragma once

#include <string>
#include <vector>

#include "aot/header.h"

namespace retrograde::aot {

// A header, NAME.pytorch.h, for programs that include ATen: for each function f
//   int f_th_(const at::Tensor& input, double number, at::Tensor& output);
// and, where the program defines RETROGRADE_TORCH_OP first, the registration of the operator. See the text's own
// beginning, and retrograde_add_torch_op in cmake/RetrogradeTorch.cmake, which writes such programs.
// Unsupported: elements that no tensor has; names in namespaces.
std::string pytorch_wrapper_text(const std::string& module_name, const Target& target,
                                 const std::vector<DeclaredFunction>& functions);

}  // namespace retrograde::aot

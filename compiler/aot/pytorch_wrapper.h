// Generates wrappers that call compiled functions on PyTorch tensors, and register them as operators.
#pragma once

#include <string>
#include <vector>

#include "aot/header.h"

namespace retrograde::aot {

// Returns a header, NAME.pytorch.h, for programs that include ATen. For each function f it defines
//   int f_th_(const at::Tensor& input, double number, at::Tensor& output);
// If the program first defines RETROGRADE_TORCH_OP, the header also registers the operator; its first comment describes
// how. retrograde_add_torch_op in cmake/RetrogradeTorch.cmake writes such programs. Unsupported: element types that no
// tensor has; names in namespaces.
std::string pytorch_wrapper_text(const std::string& module_name, const Target& target,
                                 const std::vector<DeclaredFunction>& functions);

}  // namespace retrograde::aot

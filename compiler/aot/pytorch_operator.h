// pytorch_operator.h -- a compiled function as an operator of PyTorch, with its gradients.
#pragma once

#include <string>

#include "aot/pytorch_function.h"

namespace retrograde::aot {

// Its registration, where the program defines RETROGRADE_TORCH_OP: see the text's own beginning (pytorch_text.cpp).
std::string torch_operator_text(const TorchFunction& function);

}  // namespace retrograde::aot

// pytorch_operator.h -- registers a compiled function as a PyTorch operator with gradients.
#pragma once

#include <string>

#include "aot/pytorch_function.h"

namespace retrograde::aot {

// Generates the registration, which is active if the program defines RETROGRADE_TORCH_OP; the text's first comment
// describes it (pytorch_text.cpp).
std::string torch_operator_text(const TorchFunction& function);

}  // namespace retrograde::aot

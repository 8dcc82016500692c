// C++ source that the wrappers for PyTorch consist of. pytorch_operator.cpp replaces the placeholders "$name$".
#pragma once

namespace retrograde::aot {

extern const char* const pytorch_operator_text;  // the registration of one operator
// In addition, for an operator with floating-point numbers: overloads that take numbers instead of tensors.
extern const char* const pytorch_numbers_text;
extern const char* const pytorch_register_numbers_text;
extern const char* const pytorch_helpers;         // once per program
extern const char* const pytorch_device_helpers;  // after the helpers, for GPU code

}  // namespace retrograde::aot

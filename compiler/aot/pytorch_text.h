// What wrappers for PyTorch have in common: C++ as it is written out, in which "$name$" stands for what
// pytorch_operator.cpp puts there.
#pragma once

namespace retrograde::aot {

extern const char* const pytorch_operator_text;  // the registration of one operator
// Of one with floating-point numbers, besides: with numbers for them, where the above has tensors.
extern const char* const pytorch_numbers_text;
extern const char* const pytorch_register_numbers_text;
extern const char* const pytorch_helpers;         // once in a program
extern const char* const pytorch_device_helpers;  // after them, where code is for a GPU

}  // namespace retrograde::aot

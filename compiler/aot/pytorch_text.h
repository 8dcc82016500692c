// What wrappers for PyTorch have in common: C++ as it is written out, in which "$name$" stands for what
// pytorch_wrapper.cpp puts there.
#pragma once

namespace retrograde::aot {

extern const char* const pytorch_operator_text;  // the registration of one operator
extern const char* const pytorch_helpers;        // once in a program

}  // namespace retrograde::aot

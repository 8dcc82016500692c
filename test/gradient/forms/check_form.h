// Checks the gradient of one random expression against dual numbers: by the reverse sweep, by the forward sweep, and as
// machine code.
#pragma once

#include <string>

#include "ir/expr.h"
#include "testing/choices.h"

namespace retrograde::gradient {

using fuzz::Choices;

struct FormResult {
  int checked = 0;          // places and leaves at which the gradient was compared
  int ill_conditioned = 0;  // at which rounding alone may change a tenth of a thousandth of it
  int outside = 0;          // places at which a value is infinite, NaN or denormal
  std::string finding;      // empty: all are right
  FormResult& operator+=(const FormResult& other);
};

// compile: also check machine code.
FormResult check_form(const Expr& e, uint64_t seed, bool compile);

}  // namespace retrograde::gradient

// One random expression: its gradient by the reverse sweep, the forward sweep, and as machine code,
// against dual numbers.
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

// compile: as machine code too.
FormResult check_form(const Expr& e, uint64_t seed, bool compile);

}  // namespace retrograde::gradient

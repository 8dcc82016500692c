// Generates random pointwise expressions: the forms that stable_forms.h recognises, near misses of these forms, and
// both around shared sub-expressions.
#pragma once

#include "ir/expr.h"
#include "testing/choices.h"

namespace retrograde::gradient {

using fuzz::Choices;

// An expression over the variables x, y and z of `type`. The same choices generate the same expression.
Expr make_form(Choices& choices, Type type);

}  // namespace retrograde::gradient

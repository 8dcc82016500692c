// Random pointwise expressions of the shapes that stable_forms.h looks for, of near misses of them,
// and of both around sub-expressions that they share.
#pragma once

#include "ir/expr.h"
#include "testing/choices.h"

namespace retrograde::gradient {

using fuzz::Choices;

// Over the variables x, y and z of `type`. The same choices make the same expression.
Expr make_form(Choices& choices, Type type);

}  // namespace retrograde::gradient

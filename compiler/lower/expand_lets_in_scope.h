// expand_lets_in_scope.h -- substitutes the values of the lets in scope into an expression.
#pragma once

#include "ir/visit.h"

namespace retrograde::lower {

// Returns `e` with every name of `lets` replaced by its value, and the same for the names in these values.
Expr expand_lets_in_scope(const Expr& e, const Substitution& lets);

}  // namespace retrograde::lower

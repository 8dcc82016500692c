// in_full.h -- expressions without the names that lets around them bind.
#pragma once

#include "ir/visit.h"

namespace retrograde::lower {

// `e` with the values of `lets` in it, and theirs.
Expr in_full(const Expr& e, const Substitution& lets);

}  // namespace retrograde::lower

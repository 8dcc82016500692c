// Constants made of evaluated scalars, for builders and constant folding. build.h declares the others.
#pragma once

#include "ir/expr.h"
#include "ir/scalar.h"

namespace retrograde::ir {

Expr splat(Expr value, int lanes);  // broadcast unless `lanes` is 1
Expr constant(const Scalar& s, int lanes);

}  // namespace retrograde::ir

// walk_in_bounds.h -- visits the parts of a statement with the bounds of the names in scope.
#pragma once

#include "analysis/interval.h"
#include "ir/visit.h"

namespace retrograde::lower {

// Calls `on_stmt` for each statement, before its parts, and `on_expr` for each of its expressions. Loop variables are
// bounded by their loops, lets of int32 by the bounds of their values; other lets are unbounded.
void walk_in_bounds(const Stmt& s, FunctionRef<void(const Expr&, const Scope<Interval>&)> on_expr,
                    FunctionRef<void(const Stmt&, const Scope<Interval>&)> on_stmt);

}  // namespace retrograde::lower

// walk_in_bounds.h -- the parts of a statement, each with the bounds of the names around it.
#pragma once

#include "analysis/interval.h"
#include "ir/visit.h"

namespace retrograde::lower {

// Calls `on_stmt` for each statement, before its parts, and `on_expr` for each expression of it.
// Loops bound their variables; lets of int32 lie in the bounds of their values, others anywhere.
void walk_in_bounds(const Stmt& s, FunctionRef<void(const Expr&, const Scope<Interval>&)> on_expr,
                    FunctionRef<void(const Stmt&, const Scope<Interval>&)> on_stmt);

}  // namespace retrograde::lower

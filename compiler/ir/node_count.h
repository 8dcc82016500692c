// Size limits on expressions and statements, for passes that skip large ones.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Whether it has at most `most` nodes; stops counting beyond that.
bool has_at_most_nodes(const Expr& e, int most);
bool has_at_most_nodes(const Stmt& s, int most);

}  // namespace retrograde::ir

// How large an expression or statement is, for passes that leave large ones alone.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Whether it has no more nodes than `most`; no further ones are visited.
bool has_at_most_nodes(const Expr& e, int most);
bool has_at_most_nodes(const Stmt& s, int most);

}  // namespace retrograde::ir

// walk_once.h -- a walk over several expressions that visits a node once, however many of them share it.
#pragma once

#include "ir/node_set.h"
#include "ir/visit.h"

namespace retrograde::ir {

// Like walk() of ir/visit.h, but skips the nodes of `visited`, and adds those that it visits. The caller keeps the
// expressions of earlier walks alive: the set compares addresses.
void walk_once(const Expr& e, NodeSet& visited, FunctionRef<bool(const Expr&)> enter);

}  // namespace retrograde::ir

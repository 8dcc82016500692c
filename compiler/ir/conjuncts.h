// Conditions taken apart; ir/build.h has `conjunction`, which puts them together.
#pragma once

#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {

// Appends the conditions that all hold where e does; none where e is undefined.
void add_conjuncts(const Expr& e, std::vector<Expr>& conjuncts);

}  // namespace retrograde::ir

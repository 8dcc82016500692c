// Variables by their names.
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {

// An int32 variable for each name: the arguments of a Func as its definition names them.
std::vector<Expr> variables_of(const std::vector<std::string>& names);

}  // namespace retrograde::ir

// print_expr.h -- appends an expression to a text; ir/print.h is the interface for other folders.
#pragma once

#include <string>

#include "ir/expr.h"
#include "ir/text.h"

namespace retrograde::ir {

// Omits the types that `types` implies, and adds the names that `e` mentions.
void print_expr(const Expr& e, NameTypes& types, std::string& out);

}  // namespace retrograde::ir

// Reads IR text back. Symbols are not text: parsed Funcs, images and parameters are known by name
// only.
#pragma once

#include <string>

#include "ir/expr.h"

namespace retrograde::ir {
class NameTypes;

// UserError with line, column, what was expected and what was found.
Expr parse_expr(const std::string& text);
// With the types of names that the text itself does not declare.
Expr parse_expr(const std::string& text, const NameTypes& declared);
Stmt parse_stmt(const std::string& text);
}  // namespace retrograde::ir

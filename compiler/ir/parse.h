// Parses IR text. Text holds no symbols: parsed Funcs, images and parameters are known by name
// only.
#pragma once

#include <string>

#include "ir/expr.h"

namespace retrograde::ir {
class NameTypes;

// Throws UserError with line, column, the expected and the found token.
Expr parse_expr(const std::string& text);
// `declared` holds types of names that the text itself does not declare.
Expr parse_expr(const std::string& text, const NameTypes& declared);
Stmt parse_stmt(const std::string& text);
}  // namespace retrograde::ir

// operand_checks.h -- checks of the operands of operators and functions on Exprs. Messages name the
// operator: `what`.
#pragma once

#include <string>

#include "ir/build.h"

namespace retrograde::frontend {

void check_defined(const Expr& e, const char* what);
void check_integer(const Expr& e, const char* what);
// Throws CompileError: the type of `e` breaks `rule`.
[[noreturn]] void type_error(const char* what, const std::string& rule, const Expr& e,
                             const std::string& instead = "Convert it with cast<>()");

}  // namespace retrograde::frontend

// IR text. The printer is the specification: parse(print(x)) is structurally equal to x (see parse.h, equal.h).
#pragma once

#include <iosfwd>
#include <string>

#include "ir/expr.h"

namespace retrograde {
std::ostream& operator<<(std::ostream& out, const Type& type);
std::ostream& operator<<(std::ostream& out, const Expr& e);
std::ostream& operator<<(std::ostream& out, const Stmt& s);
namespace ir {
std::string print(const Expr& e);
std::string print(const Stmt& s);
}  // namespace ir
}  // namespace retrograde

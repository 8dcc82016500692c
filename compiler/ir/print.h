// Prints IR as text. The printer is the specification of the language: parse(print(x)) is
// structurally equal to x (see parse.h, equal.h).
#pragma once

#include <iosfwd>
#include <string>

#include "ir/expr.h"

namespace retrograde {
std::ostream& operator<<(std::ostream& out, const Type& type);
std::ostream& operator<<(std::ostream& out, const Expr& e);
std::ostream& operator<<(std::ostream& out, const Stmt& s);
namespace ir {
class NameTypes;

// A function object rather than functions: argument-dependent lookup must not find it where a user
// writes print(e), an operator of the language.
struct PrintFunction {
  std::string operator()(const Expr& e) const;
  std::string operator()(const Stmt& s) const;
  // Omits the types that `types` implies, and adds the names that `e` mentions.
  std::string operator()(const Expr& e, NameTypes& types) const;
};
inline constexpr PrintFunction print{};
}  // namespace ir
}  // namespace retrograde

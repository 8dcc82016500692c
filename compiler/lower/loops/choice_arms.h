// choice_arms.h -- choices by the value of one variable, looked up instead of tried arm after arm:
//
//   select(c == 0, a, select(c == 1, b, ...))  for c == 1:  b
//
// So n copies of a body that chooses from n arms, one for each value, take n steps.
#pragma once

#include <optional>
#include <string>
#include <unordered_map>

#include "ir/expr.h"

namespace retrograde::lower {

// Remembers the choices of one body, which must outlive it.
class ChoiceArms {
 public:
  explicit ChoiceArms(std::string variable) : variable_(std::move(variable)) {}

  bool has_any(const Stmt& s) const;
  // The body where the variable has the value, without the arms of other values.
  Stmt choose(const Stmt& body, int64_t value);

 private:
  struct Table {
    std::unordered_map<int64_t, Expr> arms;
    Expr otherwise;
  };

  std::optional<int64_t> case_of(const Expr& e) const;
  Table table_of(const Expr& choice) const;
  Expr arm(const Expr& e, int64_t value);

  const std::string variable_;
  std::unordered_map<const ExprNode*, Table> tables_;  // of choices by their first select
};

}  // namespace retrograde::lower

// choice_arms.h -- resolves chains of selects on one variable by a table lookup instead of arm by arm:
//
//   select(c == 0, a, select(c == 1, b, ...))  for c == 1:  b
//
// Copying a body that chooses from n arms once for each of n values then takes n steps instead of n * n.
#pragma once

#include <optional>
#include <string>
#include <unordered_map>

#include "ir/expr.h"

namespace retrograde::lower {

// The choices of one body. The body must outlive this object.
class ChoiceArms {
 public:
  explicit ChoiceArms(std::string variable) : variable_(std::move(variable)) {}

  bool has_any(const Stmt& s) const;
  // The body for one value of the variable, without the arms of other values.
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
  std::unordered_map<const ExprNode*, Table> tables_;  // by the first select of a chain
};

}  // namespace retrograde::lower

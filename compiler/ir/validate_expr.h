// validate_expr.h -- the rules of expressions: types of operands, names and allocations in scope.
#pragma once

#include <unordered_set>

#include "ir/equal.h"
#include "ir/phase_check.h"
#include "ir/validate_scope.h"

namespace retrograde::ir {

class ExprValidator {
 public:
  ExprValidator(const PhaseCheck& phase, ValidationScope& scope) : phase_(phase), scope_(scope) {}

  // Checks each node once while the names and allocations in scope are unchanged.
  void check(const Expr& e);
  void check_index(const Expr& e) const;
  // `access`: the Expr or Stmt with this predicate (may be undefined) and this many lanes.
  template <class Node>
  void check_predicate(const Node& access, const Expr& predicate, int lanes) {
    if (!predicate.defined()) return;
    check(predicate);
    phase_.require(predicate.type() == Bool(lanes), access,
                   "a predicate is bool with the lanes of the access");
  }

 private:
  void check_node(const Expr& e);
  void check_children(const Expr& e);
  void check_variable(const Expr& e, const Variable& n) const;
  void check_let(const Expr& e, const Let& n);
  void check_binary(const Expr& e, const Binary& n);
  void check_select(const Expr& e, const Select& n);
  void check_call(const Expr& e, const Call& n);
  void check_load(const Expr& e, const Load& n);

  const PhaseCheck& phase_;
  ValidationScope& scope_;
  std::unordered_set<const ExprNode*> checked_;  // since the scope's last exit
  size_t exits_ = 0;                             // of the scope, when `checked_` was last used
  std::unordered_set<Expr, StructuralHash, StructuralEqual> lets_;
};

}  // namespace retrograde::ir

// What one node of an expression contributes to derivatives: shared by the reverse sweep, which
// carries adjoints from a value to its leaves, and the forward sweep, which carries tangents from
// the leaves to a value.
//
// Linearised:  dv = sum_i partial_i * d operand_i
#pragma once

#include <set>
#include <string>
#include <unordered_set>
#include <vector>

#include "autodiff/default_schedule.h"
#include "autodiff/derivative_rules.h"
#include "ir/expr.h"
#include "ir/visit.h"

namespace retrograde::ir {

// Children before parents, each node once. Undefined roots are skipped.
std::vector<Expr> post_order(const std::vector<Expr>& roots);

// Where derivatives end inside an expression: reads of Funcs and images, variables.
bool is_leaf(const Expr& e);

// What is true of the nodes of a DAG.
class ExprFacts {
 public:
  // `order`: children before parents. `is_wanted` says by which leaves to differentiate,
  // `is_risky_leaf` which of them may be infinite or NaN at finite inputs.
  ExprFacts(const std::vector<Expr>& order, FunctionRef<bool(const Expr&)> is_wanted,
            FunctionRef<bool(const Expr&)> is_risky_leaf);

  // Depends on a wanted leaf by a path of floating values.
  bool is_active(const Expr& e) const { return active_.contains(e.get()); }
  // May be infinite or NaN at finite operands.
  bool is_risky(const Expr& e) const { return risky_.contains(e.get()); }
  // Contains a read of a Func or image.
  bool reads(const Expr& e) const { return loads_.contains(e.get()); }
  // Casts through which a derivative is lost.
  const std::set<std::string>& notes() const { return notes_; }

 private:
  void classify(const Expr& e, FunctionRef<bool(const Expr&)> is_wanted,
                FunctionRef<bool(const Expr&)> is_risky_leaf);
  std::unordered_set<const ExprNode*> active_, risky_, loads_;
  std::set<std::string> notes_;
};

struct LocalDerivative {
  enum class Kind : uint8_t {
    Zero,    // by rule; `note` says which
    Choice,  // of operands 0 and 1 by `condition`
    Sum,     // partials times operands
  };
  Kind kind = Kind::Zero;
  std::vector<Expr> operands;
  std::vector<Partial> partials;  // Sum: one an operand; an undefined factor is 0
  Expr condition;
  std::string note;
  bool risky_operand = false, reads = false;  // one of the operands
  bool poles = false;                         // partials may be infinite where the value is finite
};

// Of an active node that is no leaf. Partials that meet infinite or NaN operands are Strong. Throws
// Unsupported where there is no rule.
LocalDerivative local_derivative(const Expr& e, const ExprFacts& facts);

// Here or in a Func between here and the output. A seed that the user gives counts as masked.
AdjointTraits traits_of(const Expr& adjoint);

// The expression with its lets substituted: a DAG without names.
Expr without_lets(const Expr& e);

}  // namespace retrograde::ir

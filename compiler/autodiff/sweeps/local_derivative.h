// What one node of an expression contributes to derivatives: shared by the reverse sweep, which
// carries adjoints from a value to its leaves, and the forward sweep, which carries tangents from
// the leaves to a value.
//
// Linearised:  dv = sum_i partial_i * d operand_i
#pragma once

#include <set>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "autodiff/rules/derivative_rules.h"
#include "graph/function.h"
#include "ir/expr.h"
#include "ir/lets.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

class ValueRanges;

// Children before parents, each node once. Undefined roots are skipped.
std::vector<Expr> post_order(const std::vector<Expr>& roots);

// Where derivatives end inside an expression: reads of Funcs and images, variables.
bool is_leaf(const Expr& e);

struct Finiteness {
  bool risky = false;     // infinite or NaN at finite operands
  bool read = false;      // what a Func or image holds, however wild that is
  bool infinite = false;  // by a leaf that may be
  bool product = false;   // of reads, which may overflow
  void add(const Finiteness& other) {
    risky |= other.risky;
    read |= other.read;
    infinite |= other.infinite;
    product |= other.product;
  }
};

// What is true of the nodes of a DAG.
class ExprFacts {
 public:
  // `order`: children before parents. `is_wanted` says by which leaves to differentiate.
  ExprFacts(const std::vector<Expr>& order, FunctionRef<bool(const Expr&)> is_wanted,
            const ValueRanges& ranges);

  // Depends on a wanted leaf by a path of floating values.
  bool is_active(const Expr& e) const { return active_.contains(e.get()); }
  // What a factor made of nodes of the DAG may be.
  Finiteness finiteness_of(const Expr& factor) const;
  // Casts through which a derivative is lost.
  const std::set<std::string>& notes() const { return notes_; }

 private:
  void classify(const Expr& e, FunctionRef<bool(const Expr&)> is_wanted, const ValueRanges& ranges);
  std::unordered_map<const ExprNode*, Finiteness> classified_;
  std::unordered_set<const ExprNode*> active_;
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
  std::vector<Finiteness> factors;  // Sum: what the partials may be
  bool poles = false;               // partials may be infinite where the value is finite
  // Sum: whether the partial may be 0 where the operand is infinite; empty: none is.
  std::vector<bool> levels_off = {};
  bool levels_off_by(size_t i) const { return i < levels_off.size() && levels_off[i]; }
};

// Of an active node that is no leaf. Partials that may be infinite or NaN are Strong. Throws
// Unsupported where there is no rule.
LocalDerivative local_derivative(const Expr& e, const ExprFacts& facts);

// Here or in a Func between here and the output. A seed that the user gives counts as masked.
AdjointTraits traits_of(const Expr& adjoint);

}  // namespace retrograde::autodiff

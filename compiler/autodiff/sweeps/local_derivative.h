// local_derivative.h -- the partial derivatives of one node of an expression, for both sweeps.
//
// The reverse sweep carries adjoints from a value to its leaves, the forward sweep tangents from the leaves to a value.
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

// All nodes below the roots, each once, children before parents. Undefined roots are skipped.
std::vector<Expr> post_order(const std::vector<Expr>& roots);

// Whether derivatives end at `e` inside an expression: at reads of Funcs and images, and at variables.
bool is_leaf(const Expr& e);

struct Finiteness {
  bool risky = false;     // infinite or NaN at finite operands
  bool read = false;      // an element of a Func or image, which may hold any bits
  bool infinite = false;  // depends on a leaf that may be infinite
  bool product = false;   // a product of reads, which may overflow
  void add(const Finiteness& other) {
    risky |= other.risky;
    read |= other.read;
    infinite |= other.infinite;
    product |= other.product;
  }
};

// Properties of the nodes of a DAG.
class ExprFacts {
 public:
  // `order` has children before parents. `is_wanted` selects the leaves to differentiate by.
  ExprFacts(const std::vector<Expr>& order, FunctionRef<bool(const Expr&)> is_wanted,
            const ValueRanges& ranges);

  // Whether `e` depends on a wanted leaf along a path of floating-point values.
  bool is_active(const Expr& e) const { return active_.contains(e.get()); }
  // Whether a factor built from nodes of the DAG may be infinite, and how.
  Finiteness finiteness_of(const Expr& factor) const;
  // The casts through which a derivative is lost.
  const std::set<std::string>& notes() const { return notes_; }

 private:
  void classify(const Expr& e, FunctionRef<bool(const Expr&)> is_wanted, const ValueRanges& ranges);
  std::unordered_map<const ExprNode*, Finiteness> classified_;
  std::unordered_set<const ExprNode*> active_;
  std::set<std::string> notes_;
};

struct LocalDerivative {
  enum class Kind : uint8_t {
    Zero,    // zero by the rule named in `note`
    Choice,  // selects operand 0 or 1 by `condition`
    Sum,     // sum of partials times operands
  };
  Kind kind = Kind::Zero;
  std::vector<Expr> operands;
  std::vector<Partial> partials;  // Sum: one for each operand; an undefined factor is 0
  Expr condition;
  std::string note;
  std::vector<Finiteness> factors;  // Sum: finiteness of the partials
  bool poles = false;               // partials may be infinite where the value is finite
  // Sum: whether the partial may be 0 where the operand is infinite. Empty means false for all.
  std::vector<bool> levels_off = {};
  bool levels_off_by(size_t i) const { return i < levels_off.size() && levels_off[i]; }
};

// The derivative of an active node that is no leaf. Partials that may be infinite or NaN are Strong. Throws Unsupported
// if there is no rule.
LocalDerivative local_derivative(const Expr& e, const ExprFacts& facts);

// The traits of an adjoint, which it may have here or in a Func between here and the output. A seed that the user
// specifies counts as masked.
AdjointTraits traits_of(const Expr& adjoint);

}  // namespace retrograde::autodiff

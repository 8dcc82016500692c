// enclosing_conditions.h -- the loops, lets and conditions around the current place of a walk, for needed_stages.
#pragma once

#include <string>
#include <unordered_set>
#include <vector>

#include "ir/visit.h"
#include "lower/loops/needed_where.h"

namespace retrograde::lower {

// How much encloses a place. Guards are choices, branches, predicates and producers; some have no usable condition.
struct Depth {
  size_t binders = 0, conditions = 0;
  int guards = 0;
};

struct EnclosingCondition {
  Expr condition;
  Depth outside;
  AtLoops at_loops;
};

class EnclosingConditions {
 public:
  using Body = FunctionRef<void()>;

  // ---- each runs the body inside of something more ----

  void inside_let(const LetStmt& n, Body body);
  void inside_loop(const For& n, Body body);
  void under(const Expr& condition, AtLoops at_loops, Body body);
  // A guard whose condition is not used.
  void inside_guard(Body body);

  // Runs the body for an expression, which may add choices.
  void around_expression(Body body);
  // Runs the body for an operand that is evaluated whatever is chosen, and whose value must be valid.
  void outside_of_choices(Body body);

  // ---- the current place ----

  Depth depth() const { return {binders_.size(), conditions_.size(), guards_}; }
  // Whether conditions inside of `outer` enclose the whole expression.
  bool is_conditional_since(const Depth& outer) const { return expression_ > outer.conditions; }
  bool is_in_kernel() const { return kernels_ > 0; }

  // The conditions inside of `outer`, outermost first, as seen from there: calls visit(enclosing, seen).
  void for_each_since(const Depth& outer,
                      FunctionRef<void(const EnclosingCondition&, const Expr&)> visit) const;
  // A condition at the current place, as seen from `outer`.
  Expr seen_from(const Depth& outer, const Expr& condition) const;

  // ---- names bound so far ----

  // Whether the condition depends on a loop.
  bool varies(const Expr& condition) const { return uses_any_variable(condition, varying_); }
  // Without the parts that depend on a vectorized loop.
  Expr without_lanes(const Expr& condition) const { return without_parts_of(condition, lanes_); }

 private:
  void inside(Binder binder, Body body);
  Expr seen_from(const Depth& outer, const EnclosingCondition& enclosing) const;

  std::vector<Binder> binders_;
  std::vector<EnclosingCondition> conditions_;
  size_t expression_ = 0;  // number of conditions around the current expression
  int guards_ = 0, kernels_ = 0;
  std::unordered_set<std::string> varying_;  // loop variables, and lets that depend on them
  std::unordered_set<std::string> lanes_;    // the same of vectorized loops
};

}  // namespace retrograde::lower

// versions.h -- builds Funcs that keep overwritten values: copies of a Func's first stages, and helpers for reverse
// loops.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

constexpr auto same_expr = [](const Expr& e) { return e; };

// A copy of f with its first `stages` stages only: its values before stage number `stages`. The default name is f's
// with "_before_update" and the update's number. `map` is applied to the expressions of the stages.
FuncPtr clone_prefix(const FuncPtr& f, int stages, const std::string& name = "",
                     Role role = Role::Version, ExprMap map = same_expr);

// Replaces calls of `f` by calls of `g` with the same arguments, followed by `extra`.
Expr call_instead(const Expr& e, const FuncPtr& f, const FuncPtr& g,
                  const std::vector<Expr>& extra = {});

// The number of an iteration of the domain: 0, 1, ... in the order of execution. Points that a predicate excludes
// count, too.
Expr iteration_number(const std::vector<ReductionVariable>& rvars);
Expr iteration_count(const std::vector<ReductionVariable>& rvars);
// The value of the loop variable when the loop runs backward, in the iteration that had `at` when it ran forward.
Expr mirrored(const ReductionVariable& loop, const Expr& at);
Substitution mirrored(
    const std::vector<ReductionVariable>& loops);  // for each loop, at its own variable
// Adds loops over the same ranges to `domain`. Returns the substitution from the old variables to the new ones.
Substitution add_copies(const DomainPtr& domain, const std::vector<ReductionVariable>& rvars);
// A choice that evaluates only the chosen branch, because steps of a loop differ in cost.
Expr choose_step(const Expr& condition, const Expr& a, const Expr& b);

}  // namespace retrograde::autodiff

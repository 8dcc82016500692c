// Funcs that keep what an update overwrites.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

constexpr auto same_expr = [](const Expr& e) { return e; };

// f with its first `stages` stages only: the values before stage number `stages`. Without a name:
// that of f and "_before_update" with its number. `map`: of what the stages say.
FuncPtr clone_prefix(const FuncPtr& f, int stages, const std::string& name = "",
                     Role role = Role::Version, ExprMap map = same_expr);

// Calls of `f` replaced by calls of `g` at the same arguments, followed by `extra` arguments.
Expr call_instead(const Expr& e, const FuncPtr& f, const FuncPtr& g,
                  const std::vector<Expr>& extra = {});

// Number of an iteration of the domain: 0, 1, ... in the order in which iterations run. Points cut
// out by a predicate count.
Expr iteration_number(const std::vector<ReductionVariable>& rvars);
Expr iteration_count(const std::vector<ReductionVariable>& rvars);
// What the loop is at when it runs backward, in the iteration that was `at` forward.
Expr mirrored(const ReductionVariable& loop, const Expr& at);
Substitution mirrored(const std::vector<ReductionVariable>& loops);  // each at its own variable
// Adds loops over the same ranges to a domain: their variables, by those that they stand for.
Substitution add_copies(const DomainPtr& domain, const std::vector<ReductionVariable>& rvars);
// Steps of a loop differ in what they cost: only the one at hand is evaluated.
Expr choose_step(const Expr& condition, const Expr& a, const Expr& b);

}  // namespace retrograde::autodiff

// access_inversion.h -- inverts an access, so that its adjoint is a gather instead of a scatter.
//
// Primal:      f(x, r) reads g(e(x, r)), for all (x, r) in the stage's domain D
// Transposed:  g_adj(y) += sum over {(x, r) in D : e(x, r) = y} of a(x, r)
//
// The access relation {(x, r) -> e(x, r)} is built over all indices at once and inverted with isl. The iterations that
// read one element y form the fibre over y. In it each stage variable is either determined, an expression of y, or
// free: base(y) + stride * rho, with a new reduction variable rho. The extent of rho is the smallest constant, else a
// parametric one; if the fibre is no box, a predicate restricts it. Data-dependent indices stay on the left-hand side.
// There the adjoint scatters, serially within each element of the determined dimensions. Exception: if the other indices
// determine the whole iteration and only the index of dimension 0 depends on data, as in logits(label(i), i), the
// predicate compares the element's own place with that index, and nothing scatters.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "analysis/interval.h"
#include "autodiff/inversion/isl_budget.h"
#include "graph/function.h"
#include "ir/expr.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

// min <= name <= max; an undefined end is unbounded.
struct LoopVariable {
  std::string name;
  Expr min, max;
  bool is_reduction = false;
  Interval range() const { return {min, max}; }
};
std::vector<std::string> names_of(const std::vector<LoopVariable>& vars);
Scope<Interval> scope_of(const std::vector<LoopVariable>& vars);

// The extent of a bounded range.
Expr extent_of(const Interval& range);
// The extent if it is constant; nullopt if it is unbounded or known at run time only.
std::optional<int64_t> constant_extent(const Interval& range);
// An unbounded end of `part` lies inside `outer` only if `outer` is unbounded there, too.
bool can_prove_inside(const Interval& part, const Interval& outer);
struct IterationDomain {
  std::vector<LoopVariable> vars;  // innermost first
  Expr predicate;                  // undefined: none
};

struct AccessQuery {
  IterationDomain domain;
  std::vector<Expr> indices;  // indices of the access, in terms of the domain's variables
  std::vector<std::string> target_args;  // pure variable of the target's adjoint for each index
  std::vector<LoopVariable> region;  // region of the target, assumed nonempty; no entries: unknown
  // Budget of isl operations for each part of the search (isl_budget.h). If it is exceeded, the access scatters.
  unsigned long operations = isl_operations;
  // Whether conditions become the bounds of reduction domains (narrow_reductions.h), which then may be empty at run
  // time. If false, reduction domains have the extents of the domain's own loops.
  bool narrows = true;
};

// One piece of an inverted access: g_adj(lhs...) += sum over rvars where predicate of a(iteration).
struct Gather {
  std::vector<Expr> lhs;  // the dimension's pure variable, a fixed index, or a data-dependent index
  std::vector<bool> pure;  // for each dimension: whether lhs is the pure variable
  std::shared_ptr<ReductionDomainContents> rdom;  // null: at most one point reads each element
  Substitution iteration;  // stage variable -> expression of the target's variables and rdom
  Expr predicate;          // undefined: all points
  bool scatters = false;   // an index is data-dependent

  bool is_everywhere() const { return std::ranges::find(pure, false) == pure.end(); }
  bool is_pointwise() const { return !rdom && !scatters && is_everywhere(); }
};

struct Inversion {
  std::vector<Gather> gathers;  // every point of the domain is in exactly one
  std::string note;             // why a part could not be inverted; empty if all was
  bool gave_up = false;         // the budget of operations was exceeded
};

Inversion invert_access(const AccessQuery& query);
// The access without inversion: all stage variables become reduction variables. Always correct, never parallel.
Gather scatter_access(const AccessQuery& query);

}  // namespace retrograde::autodiff

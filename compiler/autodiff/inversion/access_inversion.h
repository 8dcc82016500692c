// Scatter becomes gather: which points of a stage read a given element?
//
// Primal:      f(x, r) reads g(e(x, r)), for all (x, r) in the stage's domain D
// Transposed:  g_adj(y) += sum over {(x, r) in D : e(x, r) = y} of a(x, r)
//
// The access relation {(x, r) -> e(x, r)} is built over all indices at once and inverted with isl.
// In the fibre over an element y each stage variable is either determined (an expression of y) or
// free (base(y) + stride * rho, with a new reduction variable rho of the smallest constant, else
// parametric, extent); where the fibre is not a box, a predicate cuts it. Indices that depend on
// data stay on the left-hand side: there the adjoint scatters, serially within each element of the
// determined dimensions.
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

// Of a bounded one.
Expr extent_of(const Interval& range);
// nullopt: without bounds, or known at run time only.
std::optional<int64_t> constant_extent(const Interval& range);
// An end that the part has not is inside of none but the missing end of the whole.
bool can_prove_inside(const Interval& part, const Interval& whole);
struct IterationDomain {
  std::vector<LoopVariable> vars;  // innermost first
  Expr predicate;                  // undefined: none
};

struct AccessQuery {
  IterationDomain domain;
  std::vector<Expr> indices;             // of the access, over the domain's variables
  std::vector<std::string> target_args;  // pure variables of the target's adjoint, one an index
  std::vector<LoopVariable>
      region;  // of the target; may be empty (unknown). Assumed not to be an empty set.
  // Work for each part of the search (isl_budget.h); when it is not enough: the scatter.
  unsigned long operations = isl_operations;
  // Reduction domains end where conditions say (narrow_reductions.h), and may be empty at run time.
  // False: they run over the domain's own loops, as often as these do.
  bool narrows = true;
};

// One way in which elements are read: g_adj(lhs...) += sum over rvars where predicate of
// a(iteration).
struct Gather {
  std::vector<Expr>
      lhs;  // the pure variable of the dimension, a fixed index, or an index that depends on data
  std::vector<bool> pure;                         // per dimension: lhs is the pure variable
  std::shared_ptr<ReductionDomainContents> rdom;  // null: at most one point reads each element
  Substitution iteration;  // stage variable -> expression of the target's variables and rdom
  Expr predicate;          // undefined: all points
  bool scatters = false;   // an index depends on data

  bool is_everywhere() const { return std::ranges::find(pure, false) == pure.end(); }
  bool is_pointwise() const { return !rdom && !scatters && is_everywhere(); }
};

struct Inversion {
  std::vector<Gather> gathers;  // every point of the domain is in exactly one
  std::string note;             // why something could not be inverted; empty when all was
  bool gave_up = false;         // for want of operations
};

Inversion invert_access(const AccessQuery& query);
// The access as it stands: all stage variables become reduction variables. Always right, never
// parallel.
Gather scatter_access(const AccessQuery& query);

}  // namespace retrograde::autodiff

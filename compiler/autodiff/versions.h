// Funcs that keep what an update overwrites.
#pragma once

#include <optional>
#include <vector>

#include "autodiff/regions.h"
#include "frontend/function.h"

namespace retrograde::ir {

// f with its first `stages` stages only: the values before stage number `stages`.
FuncPtr clone_prefix(const FuncPtr& f, int stages);

// Calls of `f` replaced by calls of `g` at the same arguments, followed by `extra` arguments.
Expr call_instead(const Expr& e, const FuncPtr& f, const FuncPtr& g,
                  const std::vector<Expr>& extra = {});

// Number of an iteration of the domain: 0, 1, ... in the order in which iterations run. Points cut
// out by a predicate count.
Expr iteration_number(const std::vector<ReductionVariable>& rvars);
Expr iteration_count(const std::vector<ReductionVariable>& rvars);

// Stage `stage` of f, whose elements are rewritten by many iterations, as a recurrence in a new
// last dimension:
//   versions(p, 0) = f before the stage,   versions(p, t + 1) = V(versions(p, t)),   f(p) after it
//   = versions(p, T)
// nullopt unless the left-hand side and all reads of f are the pure variables themselves.
struct Versions {
  FuncPtr func;
  Box region;
};
std::optional<Versions> keep_versions(const FuncPtr& f, int stage, const FuncPtr& before,
                                      const Box& region);

}  // namespace retrograde::ir

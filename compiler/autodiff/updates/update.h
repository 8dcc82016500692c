// update.h -- differentiates one update definition: its effect on the adjoint of its own Func and the seeds of its
// contributions to others.
//
// Primal, for i over the domain in order:   f[W(i)] <- V(f[R_1(i)], f[R_2(i)], ..., others(i))
// Transposed, i in the opposite order:      a = A[W(i)];  A[W(i)] = 0;  A[R_k(i)] += a dV/df_k(i)
//
// The shapes, tried in this order:
//   accumulation  V = f[W(i)] + E(i), E free of f. A is unchanged, and E is swept with A[W(i)]. Iterations commute.
//   selection     V is either f[W(i)] or E(i), as in max, min and argmax. A helper Func recomputes which iteration
//                 wrote each element last; that iteration gets the adjoint.
//   overwriting   V is free of f, indices are affine. The last writer gets the adjoint, and A is 0 before the update
//                 where it writes.
//   recurrence    Indices are affine, and no two iterations write one element. Reads of values that an earlier
//                 iteration wrote make A a recurrence in the opposite order; reads of older values contribute to the
//                 adjoint before the update.
//   checkpoints   With a budget, any other loop over time: it runs backward from a few kept states (checkpoint.h).
//   fold          Iterations that read and write a single element, as products do. The steps of each element become a
//                 dimension, and its adjoint a recurrence along it (fold_into_element.h).
//   steps         In-place updates in steps, the points of one step independent of each other, as in red-black
//                 relaxation. The steps become a dimension, and the adjoint a recurrence along it (in_place_steps.h).
//   tape          Anything else. The iterations run backward one by one for each element of the pure dimensions, and
//                 the values that they need are kept (tape.h).
//
// A value that a partial needs must still be in f at the end, as proven over index sets. Otherwise it is kept within a
// budget (version_budget.h), or this is an error.
#pragma once

#include <functional>
#include <map>
#include <vector>

#include "autodiff/report/explain.h"
#include "autodiff/rules/value_range.h"
#include "autodiff/sums/accumulation.h"
#include "autodiff/sweeps/regions.h"
#include "autodiff/sweeps/reverse_sweep.h"
#include "autodiff/updates/version_budget.h"
#include "ir/equal.h"

namespace retrograde::autodiff {

// Replacements for reads of an updated Func by itself, in partials, where the value read is not the final value.
using SelfValues = std::map<Expr, Expr, StructuralLess>;

// The budget for states of a loop over time: one of the two numbers, or none.
struct CheckpointBudget {
  int64_t states = 0, bytes = 0;
  bool is_set() const { return states > 0 || bytes > 0; }
};

struct UpdateQuery {
  FuncPtr f;
  int stage;
  const Regions& regions;
  const AdjointTarget& target;
  const AdjointFunc& adjoint;  // adjoint of f after the stage
  bool extendable;             // the adjoint has no consumer yet
  VersionBudget& versions;     // budget for overwritten values
  CheckpointBudget checkpoints;
  std::function<bool(const Expr&)> is_wanted;
  const ValueRanges& ranges;
};

// A contribution to the symbol that `leaf` reads, for each point of the domain.
struct DirectContribution {
  LeafAdjoint leaf;
  IterationDomain domain;
};

struct UpdateAdjoint {
  AdjointFunc current;       // the adjoint after the stage, which its contributions read
  AdjointFunc previous;      // the adjoint before the stage; null: the same as `current`
  std::vector<Expr> values;  // values to sweep for contributions to others; undefined: none
  std::vector<Expr> seeds;   // their adjoints; empty: `current` where the stage writes
  std::vector<IterationDomain> domains;    // domains of the sweep
  std::vector<DirectContribution> direct;  // contributions to others that need no sweep
  SelfValues self_values;
  bool keeps_steps = false;      // f or a helper has an element for every iteration
  std::vector<FuncPtr> helpers;  // generated Funcs, producers first
  std::vector<Explanation> explanations;
};

UpdateAdjoint differentiate_update(const UpdateQuery& query);

}  // namespace retrograde::autodiff

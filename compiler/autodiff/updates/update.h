// The adjoint of an update definition: what it does to the adjoint of its own Func, and what its
// contributions are swept from.
//
// Primal, for i over the domain in order:   f[W(i)] <- V(f[R_1(i)], f[R_2(i)], ..., others(i))
// Transposed, i in the opposite order:      a = A[W(i)];  A[W(i)] = 0;  A[R_k(i)] += a dV/df_k(i)
//
// The shapes, tried in this order:
//   accumulation  V = f[W(i)] + E(i), E free of f: A stays as it is, E is swept with A[W(i)].
//                 Iterations commute.
//   selection     V takes either f[W(i)] or E(i), as max, min and argmax do: a helper Func computes
//                 again which iteration wrote each element last; that one gets the adjoint.
//   overwriting   V free of f, places known: the last writer gets the adjoint, and A is 0 before
//                 the update where it writes.
//   recurrence    places known and writes that never meet: reads of values that an earlier
//                 iteration wrote make A a recurrence in the opposite order, reads of older values
//                 contribute to the adjoint before the update.
//   checkpoints   with a budget, anything else in a loop over time: run backward from a few kept
//                 states (checkpoint.h).
//   fold          iterations that read and write one element only, as products do: the steps of
//                 each element become a dimension, and its adjoint a recurrence along it (fold_into_element.h).
//   tape          anything else: the iterations run backward one by one inside each element of the
//                 pure dimensions, and what they need is kept (tape.h).
// A value that a partial needs must still be in f at the end: proven over index sets, never
// sampled. Otherwise the values are kept within a budget (version_budget.h), or this is an error.
#pragma once

#include <functional>
#include <map>
#include <vector>

#include "autodiff/report/explain.h"
#include "autodiff/rules/value_range.h"
#include "autodiff/sweeps/accumulation.h"
#include "autodiff/sweeps/regions.h"
#include "autodiff/sweeps/reverse_sweep.h"
#include "autodiff/updates/version_budget.h"
#include "ir/equal.h"

namespace retrograde::autodiff {

// What a read of an updated Func by itself is in a partial, where it is not the final value.
using SelfValues = std::map<Expr, Expr, StructuralLess>;

// Room for states of a loop over time: one of the two numbers, or none.
struct CheckpointBudget {
  int64_t states = 0, bytes = 0;
  bool is_given() const { return states > 0 || bytes > 0; }
};

struct UpdateQuery {
  FuncPtr f;
  int stage;
  const Regions& regions;
  const AdjointTarget& target;
  const AdjointFunc& adjoint;  // of f after the stage
  bool extendable;             // nothing reads it yet
  VersionBudget& versions;     // for values that updates overwrite
  CheckpointBudget checkpoints;
  std::function<bool(const Expr&)> is_wanted;
  const ValueRanges& ranges;
};

// A contribution to what `leaf` reads, for each point of the domain.
struct GivenAdjoint {
  LeafAdjoint leaf;
  IterationDomain domain;
};

struct UpdateAdjoint {
  AdjointFunc current;                   // the adjoint that contributions of this stage read
  AdjointFunc previous;                  // before the stage; null: the same as `current`
  std::vector<Expr> values;              // to sweep for contributions to others; undefined: none
  std::vector<Expr> seeds;               // their adjoints; empty: `current` where the stage writes
  std::vector<IterationDomain> domains;  // over which
  std::vector<GivenAdjoint> given;       // contributions to others that need no sweep
  SelfValues self_values;
  bool keeps_steps = false;      // f, or a helper, has an element for every iteration
  std::vector<FuncPtr> helpers;  // Funcs made on the way, producers first
  std::vector<Explanation> explanations;
};

UpdateAdjoint differentiate_update(const UpdateQuery& query);

}  // namespace retrograde::autodiff

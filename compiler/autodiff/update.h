// The adjoint of an update definition: what it does to the adjoint of its own Func, and what its
// contributions are swept from.
//
// One update runs, for i over its domain in order,   f[W(i)] <- V(f[R_1(i)], f[R_2(i)], ...,
// others(i)). Reversed, in the opposite order:                   a = A[W(i)];  A[W(i)] = 0;
// A[R_k(i)] += a * dV/df_k(i). Four shapes, tried in this order:
//   accumulation  V = f[W(i)] + E(i), E free of f: A stays as it is, E is swept with A[W(i)].
//   Iterations commute. selection     V takes either f[W(i)] or E(i), as max, min and argmax do: a
//   helper Func recomputes which iteration
//                 wrote each element last; that one gets the adjoint.
//   overwriting   V free of f: the last writer gets the adjoint, and A is 0 before the update where
//   it writes. recurrence    anything else whose writes never meet: reads of values that an earlier
//   iteration wrote make A a
//                 recurrence in the opposite order, reads of older values contribute to the adjoint
//                 before the update.
// A value that a partial needs must still be in f at the end: proven over index sets, never
// sampled. Otherwise this is an error, or with Overwritten::Store the versions are kept.
#pragma once

#include <functional>
#include <map>
#include <vector>

#include "autodiff/accumulation.h"
#include "autodiff/explain.h"
#include "autodiff/regions.h"
#include "ir/equal.h"

namespace retrograde::ir {

struct UpdateQuery {
  FuncPtr f;
  int stage;
  const Regions& regions;
  const AdjointTarget& target;
  const AdjointFunc& adjoint;  // of f after the stage
  bool extendable;             // nothing reads it yet
  bool store_overwritten;
  std::function<bool(const Expr&)> is_wanted;
};

struct UpdateAdjoint {
  AdjointFunc current;                   // the adjoint that contributions of this stage read
  AdjointFunc previous;                  // before the stage; null: the same as `current`
  std::vector<Expr> values;              // to sweep for contributions to others; undefined: none
  std::vector<IterationDomain> domains;  // over which
  std::map<Expr, Expr, StructuralLess>
      self_values;  // what a call of f itself is in a partial, when not f's final value
  std::vector<FuncPtr>
      versions;  // Funcs made for kept versions, to be differentiated next, consumers first
  std::vector<Box> version_regions;  // of each
  std::vector<Explanation> explanations;
};

UpdateAdjoint differentiate_update(const UpdateQuery& query);

}  // namespace retrograde::ir

// The forward pipeline of a graph of Funcs: tangents as Funcs.
//
// Primal:      f_n = F_n(f_0, ..., f_{n-1}, images, parameters), Funcs in topological order, each a
//              chain of stages
// Linearised:  df_n = sum_j (dF_n / df_j) df_j, Funcs and stages in the same order
//
// The tangent of a Func has its stages: same places, same reduction domains, same predicates, so
// nothing is inverted, and every update that runs has a tangent. A stage whose partials (or places,
// or predicate) read the Func itself needs the values as they are at that moment, which updates
// then overwrite. Such a Func is computed again together with its tangent, as one Tuple, in which
// the two are in step by construction:
//
//   f(x, r) = sin(f(x, r - 1))      f_dual(x, r) = {sin(u), cos(u) * u_tan}
//                                   with {u, u_tan} = f_dual(x, r - 1)
#pragma once

#include <map>
#include <vector>

#include "autodiff/report/explain.h"
#include "graph/function.h"

namespace retrograde::autodiff {

// By what each input is perturbed: a Func with its dimensions, and one value for each of its
// values. That of a Func is added to its values after the last definition.
using Directions = std::map<const Symbol*, FuncPtr>;

struct TangentResult {
  std::map<const Symbol*, FuncPtr> tangents;  // of Funcs; one that is missing is zero
  std::vector<FuncPtr> order;                 // Funcs that the output depends on, it too
  std::vector<FuncPtr> funcs;                 // all that was made, producers before consumers
  std::vector<Explanation> explanations;
};

TangentResult synthesize_tangents(const FuncPtr& output, const Directions& directions);
// The tangent of a Func that has none: zeros.
FuncPtr zero_tangent(const FuncContents& f);

}  // namespace retrograde::autodiff

// tangent_synthesis.h -- forward mode: builds the tangent pipeline of a graph of Funcs, as Funcs.
//
// Primal:      f_n = F_n(f_0, ..., f_{n-1}, images, parameters), Funcs in topological order, each a chain of stages
// Linearised:  df_n = sum_j (dF_n / df_j) df_j, Funcs and stages in the same order
//
// The tangent of a Func has its stages, with the same indices, reduction domains and predicates. Nothing is inverted,
// and every legal update has a tangent. If the partials, indices or predicate of a stage read the Func itself, the
// tangent needs the values of that moment, which later updates overwrite. Such a Func is recomputed together with its
// tangent, as one Tuple, so the two are in step by construction:
//
//   f(x, r) = sin(f(x, r - 1))      f_dual(x, r) = {sin(u), cos(u) * u_tan}
//                                   with {u, u_tan} = f_dual(x, r - 1)
#pragma once

#include <map>
#include <vector>

#include "autodiff/report/explain.h"
#include "graph/function.h"

namespace retrograde::autodiff {

// The perturbation of each input: a Func with the input's dimensions and number of values. A perturbation of a Func is
// added to the Func's values after its last definition.
using Directions = std::map<const Symbol*, FuncPtr>;

struct TangentResult {
  std::map<const Symbol*, FuncPtr> tangents;  // by Func; a missing tangent is zero
  std::vector<FuncPtr> order;                 // Funcs that the output depends on, and the output
  std::vector<FuncPtr> funcs;                 // all generated Funcs, producers before consumers
  std::vector<Explanation> explanations;
};

TangentResult synthesize_tangents(const FuncPtr& output, const Directions& directions);
// The zero tangent of a Func.
FuncPtr zero_tangent(const FuncContents& f);

}  // namespace retrograde::autodiff

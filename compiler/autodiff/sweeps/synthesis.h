// The reverse pipeline of a graph of Funcs, as Funcs.
//
// Primal:      f_n = F_n(f_0, ..., f_{n-1}, images, parameters), Funcs in topological order, each a
//              chain of stages
// Linearised:  df_n = sum_j (dF_n / df_j) df_j
// Transposed:  f_j_adj = sum_n (dF_n / df_j)^T f_n_adj, Funcs in the opposite order, stages from
//              last to first
//
// Every access of a stage contributes to the adjoint of what it reads; access_inversion.h turns the
// contribution into a gather, accumulation.h adds them up. update.h handles updates that read or
// overwrite their own Func.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "autodiff/report/explain.h"
#include "autodiff/report/operation_count.h"
#include "autodiff/sweeps/accumulation.h"
#include "autodiff/sweeps/regions.h"
#include "autodiff/updates/update.h"
#include "autodiff/updates/version_budget.h"
#include "graph/function.h"

namespace retrograde::autodiff {

struct SynthesisOptions {
  VersionRules versions;
  CheckpointBudget checkpoints;
  bool only_requested = false;                  // else everything that the output depends on
  std::unordered_set<const Symbol*> requested;  // Funcs and parameters
  std::unordered_map<const Symbol*, std::string> left_out;  // parameters, and why
};

// The adjoint of the output: an expression over its pure variables for each value; undefined: zero.
struct Seed {
  FuncPtr output;
  Box region;
  std::vector<Expr> values;
};

struct SynthesisResult {
  // By Func and stage: the adjoint of the Func as it is after that stage.
  std::map<std::pair<const Symbol*, int>, FuncPtr> after_stage;
  std::map<const Symbol*, FuncPtr> parameters;    // images and scalars
  std::map<const Symbol*, FuncPtr> accumulators;  // of adjoints that sum in double: by adjoint
  std::vector<FuncPtr> funcs;                     // all that was made, producers before consumers
  std::vector<Explanation> explanations;
  std::vector<std::shared_ptr<Symbol>> requested;  // kept alive: nothing else may hold them
  // What was differentiated, and what for: the adjoints of what was requested, else of all images
  // and parameters, or of all Funcs where there are none.
  WantedFunc output;
  std::vector<WantedFunc> gradients;
};

SynthesisResult synthesize_adjoints(const Seed& seed, const SynthesisOptions& options);

}  // namespace retrograde::autodiff

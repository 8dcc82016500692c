// synthesis.h -- reverse mode: builds the adjoint pipeline of a graph of Funcs, as Funcs.
//
// Primal:      f_n = F_n(f_0, ..., f_{n-1}, images, parameters), Funcs in topological order, each a chain of stages
// Linearised:  df_n = sum_j (dF_n / df_j) df_j
// Transposed:  f_j_adj = sum_n (dF_n / df_j)^T f_n_adj, Funcs in the opposite order, stages from last to first
//
// Every access of a stage contributes to the adjoint of the Func or image that it reads. access_inversion.h turns the
// contribution into a gather, accumulation.h adds the contributions up, and update.h handles updates that read or
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
#include "autodiff/sums/accumulation.h"
#include "autodiff/sweeps/regions.h"
#include "autodiff/updates/update.h"
#include "autodiff/updates/version_budget.h"
#include "graph/function.h"

namespace retrograde::autodiff {

struct SynthesisOptions {
  VersionRules versions;
  CheckpointBudget checkpoints;
  bool only_requested = false;                  // false: all inputs that the output depends on
  std::unordered_set<const Symbol*> requested;  // Funcs and parameters
  std::unordered_map<const Symbol*, std::string> left_out;  // parameters, with the reason
};

// The adjoint of an output: for each value an expression in the output's pure variables; undefined means zero.
struct Seed {
  FuncPtr output;
  Box region;
  std::vector<Expr> values;
};
// Those of all outputs. One may be read by another, and may occur again: its adjoints add up.
using Seeds = std::vector<Seed>;
std::vector<FuncPtr> outputs_of(const Seeds& seeds);
// The region of each output.
std::map<const Symbol*, Box> regions_of(const Seeds& seeds);

struct SynthesisResult {
  // Key: Func and stage. Value: the adjoint of the Func as it is after that stage.
  std::map<std::pair<const Symbol*, int>, FuncPtr> after_stage;
  std::map<const Symbol*, FuncPtr> parameters;    // by image or scalar parameter
  std::map<const Symbol*, FuncPtr> accumulators;  // the sum in double, by adjoint
  std::vector<FuncPtr> funcs;                     // all generated Funcs, producers before consumers
  std::vector<Explanation> explanations;
  std::vector<std::shared_ptr<Symbol>> requested;  // kept alive here, possibly by nothing else
  // The outputs that were differentiated, in the order of the seeds, and their gradients: those of the requested
  // symbols; else of all images and parameters; else, if there are none, of all Funcs.
  std::vector<WantedFunc> outputs, gradients;
};

SynthesisResult synthesize_adjoints(const Seeds& seeds, const SynthesisOptions& options);

}  // namespace retrograde::autodiff

// copy_graph.h -- copies a graph of Funcs for passes from graph to graph. A pass may schedule or
// redefine a Func of the copy without changing the user's Func.
#pragma once

#include <unordered_map>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

using FuncCopies = std::unordered_map<const FuncContents*, FuncPtr>;  // keyed by the original

struct GraphCopy {
  std::vector<FuncPtr> outputs;
  FuncCopies of;
};

// Copies all Funcs that the outputs depend on; parameters and reduction domains are shared with the
// original. Sharing among the expressions of definitions is preserved. Wrappers must be applied
// first.
GraphCopy copy_graph(const std::vector<FuncPtr>& outputs);

// Whether the call is the one by which the Func that an image converts to refers to the image: weakly, since the image owns
// that Func. A copy of the Func has to keep the image, with the second function.
bool is_weak_read(const Call& call);
Expr owning_read(const Call& call, std::vector<Expr> args);

// Redirects prefetches in `f` from copied Funcs to their copies.
void redirect_prefetches(FuncContents& f, const FuncCopies& copies);

}  // namespace retrograde::graph

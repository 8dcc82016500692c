// copy_graph.h -- the same graph in another place, for passes from graph to graph: a Func of the
// copy may be given another schedule or definition without its user's Func changing.
#pragma once

#include <unordered_map>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

using FuncCopies = std::unordered_map<const FuncContents*, FuncPtr>;  // by what was copied

struct GraphCopy {
  std::vector<FuncPtr> outputs;
  FuncCopies of;
};

// All Funcs that the outputs depend on; parameters and reduction domains are shared with the
// original. Expressions that definitions share stay shared. Wrappers are to have been applied.
GraphCopy copy_graph(const std::vector<FuncPtr>& outputs);

// What the Func prefetches of one that was copied is of the copy.
void redirect_prefetches(FuncContents& f, const FuncCopies& copies);

}  // namespace retrograde::graph

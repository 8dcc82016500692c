// copy_graph.h -- the same graph in another place, for passes from graph to graph: a Func of the
// copy may be given another schedule or definition without its user's Func changing.
#pragma once

#include <unordered_map>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

struct GraphCopy {
  std::vector<FuncPtr> outputs;
  std::unordered_map<const FuncContents*, FuncPtr> of;  // by the Funcs that were copied
};

// All Funcs that the outputs depend on; parameters and reduction domains are shared with the
// original. Expressions that definitions share stay shared. Wrappers are to have been applied.
GraphCopy copy_graph(const std::vector<FuncPtr>& outputs);

}  // namespace retrograde::graph

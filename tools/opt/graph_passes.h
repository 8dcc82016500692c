// graph_passes.h -- the passes from graph to graph by name, which tools/opt and the golden tests run.
#pragma once

#include <string>
#include <vector>

#include "graph/graph.h"

namespace retrograde::opt {

using namespace autodiff;

struct GraphPass {
  const char* name;
  std::vector<FuncPtr> (*run)(const std::vector<FuncPtr>& outputs);
};
// In the order in which a compilation runs them.
const std::vector<GraphPass>& graph_passes();
const GraphPass* find_graph_pass(const std::string& name);  // null if unknown

}  // namespace retrograde::opt

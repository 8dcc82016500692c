#include "autodiff/graph_passes.h"

#include <algorithm>

#include "autodiff/default_schedule.h"
#include "graph/wrappers.h"

namespace retrograde::ir {

const std::vector<GraphPass>& graph_passes() {
  static const std::vector<GraphPass> passes{{"apply_wrappers", apply_wrappers},
                                             {"schedule_unscheduled", schedule_unscheduled}};
  return passes;
}

const GraphPass* find_graph_pass(const std::string& name) {
  const auto& all = graph_passes();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const GraphPass& pass) { return pass.name == name; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace retrograde::ir

#include "graph_passes.h"

#include <algorithm>

#include "autodiff/derivative.h"
#include "autoschedule/rewrites/rewrites.h"
#include "driver/plan_schedule.h"
#include "driver/schedule.h"
#include "graph/copy_graph.h"
#include "graph/directives/wrappers.h"
#include "transform/graph_rewrites.h"

namespace retrograde::opt {

namespace {

// Adds the adjoints of all images and parameters that the first output depends on to the outputs.
std::vector<FuncPtr> with_adjoints(const std::vector<FuncPtr>& outputs) {
  const Derivative d = retrograde::propagate_adjoints(Func(outputs[0]));
  std::vector<FuncPtr> result = outputs;
  for (const auto& parameter : parameters_of(outputs)) {
    const AdjointInput input(parameter);
    if (d.has(input)) result.push_back(d.of(input).function());
  }
  return result;
}

}  // namespace

const std::vector<GraphPass>& graph_passes() {
  static const std::vector<GraphPass> passes{
      {"propagate_adjoints", with_adjoints},
      {"apply_wrappers", apply_wrappers},
      {"graph_rewrites",
       [](const std::vector<FuncPtr>& outputs) {
         return transform::with_graph_rewrites(outputs, /*on_gpu=*/false,
                                               transform::SumOrder::Free);
       }},
      {"rewrites",
       [](const std::vector<FuncPtr>& outputs) { return planning::with_rewrites(outputs); }},
      {"auto_schedule",
       [](const std::vector<FuncPtr>& outputs) {
         return driver::schedule_by_plan(graph::apply_wrappers(outputs), {},
                                         driver::Scheduling::Everything)
             .outputs;
       }},
      {"schedule_unscheduled",
       [](const std::vector<FuncPtr>& outputs) { return driver::schedule_unscheduled(outputs); }}};
  return passes;
}

const GraphPass* find_graph_pass(const std::string& name) {
  const auto& all = graph_passes();
  const auto found =
      std::ranges::find_if(all, [&](const GraphPass& pass) { return pass.name == name; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace retrograde::opt

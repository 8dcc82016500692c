// plan_sample.h -- a program and different plans of it, the same in each run.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "autoschedule/machine/machine.h"
#include "autoschedule/plan/plan.h"
#include "graph/graph.h"
#include "ir/target.h"

namespace bench::plans {

using retrograde::Target;
using retrograde::graph::FuncPtr;
namespace planning = retrograde::planning;

// A program from its text. Expressions do not keep the parameters that they read: the graph does.
struct LoadedProgram {
  retrograde::graph::Graph graph;
  // As scheduling finds them: wrappers are applied and, in gradients, definitions have the forms that scheduling expects.
  std::vector<FuncPtr> outputs;
};
// Inputs are bound to made-up values. Requires: the text of a graph (graph/graph.h).
LoadedProgram load_program(const std::string& text);

struct SampledPlan {
  std::string source;  // where it comes from: "rules", "search 3", "walk 7"
  std::string key;     // equal for equal plans, in each run
  planning::Plan plan;
};

struct SampleOptions {
  Target target;
  size_t rules = 16;  // plans of the rules, with decisions left out and figures doubled or halved
  uint32_t seed = 1;
};

// Adds plans to those that a sample has; the default schedule is the first. Plans may belong to different programs, where
// a schedule adds Funcs.
using PlanSource = std::function<std::vector<SampledPlan>(const std::vector<FuncPtr>& outputs,
                                                          const SampleOptions& options,
                                                          const SampledPlan& standard)>;

// The default schedule, then those of every source. Equal plans occur once.
std::vector<SampledPlan> sample_plans(const std::vector<FuncPtr>& outputs,
                                      const SampleOptions& options);

}  // namespace bench::plans

// plan_sample.h -- different plans of a program, the same in each run.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "autoschedule/access/sizes.h"
#include "autoschedule/machine/machine.h"
#include "autoschedule/plan/plan.h"
#include "ir/target.h"
#include "loaded_program.h"

namespace bench::plans {

using retrograde::Target;
namespace planning = retrograde::planning;

struct SampledPlan {
  // Where it comes from: "default", "without", "walk tile root", "beam 1", "no tile". If searches over moves take it,
  // too, they are named: "default, beam 1, no tile".
  std::string source;
  std::string key;  // equal for equal plans, in each run
  planning::Plan plan;
};

struct SampleOptions {
  Target target;
  planning::Machine machine;      // for which plans are searched
  size_t decisions = 16;          // default plans without one or two decisions
  size_t walks = 16;              // plans of random moves from the default plan
  uint32_t seed = 1;              // of the moves
  std::vector<int> widths = {1};  // searches over moves, a plan each
  bool ablation = false;          // searches of width 1 without one of the moves, a plan each
};

// The default schedule.
struct StandardPlan : SampledPlan {
  std::vector<FuncPtr> rewritten;  // the graph that has it
};
// Plans may belong to different programs, where a schedule adds Funcs.
using PlanSource = std::function<std::vector<SampledPlan>(const std::vector<FuncPtr>& outputs,
                                                          const SampleOptions& options,
                                                          const StandardPlan& standard)>;

// The default schedule, then those of every source. Equal plans occur once.
std::vector<SampledPlan> sample_plans(const std::vector<FuncPtr>& outputs,
                                      const SampleOptions& options);

}  // namespace bench::plans

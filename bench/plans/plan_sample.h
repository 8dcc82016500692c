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

// Extents of which nothing is known.
inline constexpr planning::SizeDefaults unknown_sizes{1000};

struct SampledPlan {
  std::string source;  // where it comes from: "rules", "search 3", "walk 7"
  std::string key;     // equal for equal plans, in each run
  planning::Plan plan;
};

struct SampleOptions {
  Target target;
  size_t rules = 16;  // plans of a search over the rules' decisions
  size_t walks = 16;  // plans of random moves from the default plan
  uint32_t seed = 1;  // of the moves
};

// `standard` is the plan of the default schedule. Plans may belong to different programs, where a schedule adds Funcs.
using PlanSource = std::function<std::vector<SampledPlan>(const std::vector<FuncPtr>& outputs,
                                                          const SampleOptions& options,
                                                          const SampledPlan& standard)>;

// The default schedule, then those of every source. Equal plans occur once.
std::vector<SampledPlan> sample_plans(const std::vector<FuncPtr>& outputs,
                                      const SampleOptions& options);

}  // namespace bench::plans

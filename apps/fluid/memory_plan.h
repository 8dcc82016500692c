// memory_plan.h -- how many states a run may keep within --memory.
#pragma once

#include <vector>

#include "common/minimize.h"
#include "scene.h"

namespace fluid {

struct MemoryPlan {
  int slots = 1;            // states that are kept, at most one a frame
  double state_mb = 0;      // of one of them
  double variables_mb = 0;  // of the optimizers' vectors
};

// Throws retrograde::UserError where a frame alone does not fit: before anything is made.
void require_memory_for_a_frame(const Scene& scene, double limit_mb);

// `used_mb`: what the program takes already, with everything compiled and run once. Throws
// retrograde::UserError where not even one state fits.
MemoryPlan plan_memory(const Scene& scene, const std::vector<apps::Method>& methods,
                       double limit_mb, double used_mb);

}  // namespace fluid

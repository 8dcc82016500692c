// memory_plan.h -- the number of states that a run may keep within --memory.
#pragma once

#include <vector>

#include "common/minimize.h"
#include "scene.h"

namespace fluid {

struct MemoryPlan {
  int slots = 1;            // states that are kept, at most one per frame
  double state_mb = 0;      // per state
  double variables_mb = 0;  // of the optimizers' vectors
};

// Throws retrograde::UserError if even one frame does not fit, before anything is allocated.
void require_memory_for_a_frame(const Scene& scene, double limit_mb);

// `used_mb`: memory in use once everything is compiled and has run once. Throws retrograde::UserError if not even one
// state fits.
MemoryPlan plan_memory(const Scene& scene, const std::vector<apps::Method>& methods,
                       double limit_mb, double used_mb);

}  // namespace fluid

// schedule_request.h -- what a schedule is made for, what its user said of it, and what comes out.
#pragma once

#include <cstdint>
#include <vector>

#include "autoschedule/machine/device.h"
#include "autoschedule/machine/machine.h"
#include "frontend/schedule/autoschedule_options.h"
#include "frontend/schedule/autoscheduler.h"
#include "graph/function.h"

namespace retrograde::driver {

struct ScheduleRequest {
  planning::Machine machine =
      {};  // with the reference threads, so that those of the options decide no bit
  AutoscheduleOptions options = {};
  planning::Device device = {};
  // All of a pipeline is scheduled for a device: its stages are kernels (autoschedule/moves/kernels.cpp).
  bool on_gpu = false;

  bool makes(Decision decision) const { return !options.without.contains(decision); }
};

// The request of a user: constants for the target, with the last cache of `params`. Their threads count unless they are
// the generic ones or the options have some.
ScheduleRequest request_for(const Target& target, const AutoscheduleOptions& options,
                            const MachineParams& params = {});

// The Funcs of a graph that get a schedule: adjoints and the Funcs computed with them, or all.
enum class Scheduling : uint8_t { Gradients, Everything };

// Bytes of a call, at the most: inputs and outputs, too.
struct MemoryUse {
  int64_t bytes = 0, budget_bytes = 0;
};
struct ScheduledGraph {
  std::vector<FuncPtr> outputs;  // of a copy of the graph
  MemoryUse memory;
};

}  // namespace retrograde::driver

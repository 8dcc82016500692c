// schedule_request.h -- what a schedule is made for, and what its user said of it.
#pragma once

#include <set>
#include <string>

#include "autoschedule/machine/device.h"
#include "autoschedule/machine/machine.h"
#include "frontend/schedule/autoschedule_options.h"
#include "frontend/schedule/autoscheduler.h"

namespace retrograde::autoschedule {

struct ScheduleRequest {
  planning::Machine machine = {};
  AutoscheduleOptions options = {};
  planning::Device device = {};
  // What a budget (memory_budget.h) wants computed where it is read, where that can be.
  std::set<std::string> recomputed = {};
  // Private parts one for each thread, added up by atomic updates (atomic_scatters.h): what a budget
  // wants of a schedule whose bits may differ.
  bool atomic_parts = false;
  // All of a pipeline is scheduled for a device: its stages are kernels (autoschedule/moves/kernels.cpp).
  bool on_gpu = false;

  bool makes(Decision decision) const { return !options.without.contains(decision); }
};

// The request of a user: constants for the target, with the last cache of `params`. Their threads count unless they are
// the generic ones or the options have some.
ScheduleRequest request_for(const Target& target, const AutoscheduleOptions& options,
                            const MachineParams& params = {});

// The machine with the threads of the options: what sizes are weighed against.
planning::Machine machine_of(const ScheduleRequest& request);

}  // namespace retrograde::autoschedule

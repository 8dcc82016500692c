// schedule_request.h -- what a schedule is made for, and what its user said of it.
#pragma once

#include <set>
#include <string>

#include "autoschedule/machine/device.h"
#include "autoschedule/machine/machine.h"
#include "frontend/schedule/autoschedule_options.h"
#include "frontend/schedule/autoscheduler.h"

namespace retrograde::autoschedule {

// What the rules choose by a number of theirs: how often a search doubles it; -1: half of it.
struct ScheduleScales {
  int register_tile = 0;  // bytes of sums in registers
  int tasks = 0;          // that make enough of them
  int strip_rows = 0;
  int caches = 0;  // bytes that stay in them
  friend bool operator==(const ScheduleScales&, const ScheduleScales&) = default;
};

struct ScheduleRequest {
  planning::Machine machine = {};
  AutoscheduleOptions options = {};
  planning::Device device = {};
  // What a search or a budget (memory_budget.h) wants computed where it is read, and what stored,
  // where that can be.
  std::set<std::string> recomputed = {}, stored = {};
  ScheduleScales scales = {};
  // Private parts one for each thread, added up by atomic updates (atomic_scatters.h): what a budget
  // wants of a schedule whose bits may differ.
  bool atomic_parts = false;
  // All of a pipeline is scheduled for a device: its stages are kernels (gpu_schedule.h).
  bool on_gpu = false;

  bool makes(Decision decision) const { return !options.without.contains(decision); }
};

// The request of a user: constants for the target, with the last cache of `params`. Their threads count unless they are
// the generic ones or the options have some.
ScheduleRequest request_for(const Target& target, const AutoscheduleOptions& options,
                            const MachineParams& params = {});

// The machine with the threads of the options and the scales of a search: what sizes are weighed against.
planning::Machine machine_of(const ScheduleRequest& request);

}  // namespace retrograde::autoschedule

#include "driver/schedule_request.h"

#include <algorithm>

namespace retrograde::driver {

ScheduleRequest request_for(const Target& target, const AutoscheduleOptions& options,
                            const MachineParams& params) {
  ScheduleRequest request{planning::reference_machine(target), options};
  request.machine.levels[planning::Machine::last_cache].bytes =
      static_cast<double>(params.last_level_cache_size);
  if (options.threads <= 0 && params != MachineParams::generic())
    request.options.threads = std::max(params.parallelism, 0);
  return request;
}

}  // namespace retrograde::driver

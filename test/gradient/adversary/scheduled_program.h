// Generates random programs for the autoscheduler, with their options.
#pragma once

#include <optional>

#include "frontend/schedule/autoschedule_options.h"
#include "gradient/adversary/gradient_pipeline.h"

namespace retrograde::gradient {

struct ScheduledProgram {
  AdversaryProgram program;
  Extents extents = Extents::Constant;
  AutoscheduleOptions told = {};
  bool is_whole =
      true;  // scheduled by Pipeline::auto_schedule() instead of the default schedule of gradients
  // For a large program: the same structure at a size that the interpreter can handle.
  std::optional<AdversaryProgram> small = {};
};

// Throws UserError if the choices describe no legal program.
ScheduledProgram make_scheduled(Choices& choices, std::optional<fuzz::Workload> workload = {});
std::string to_text(const ScheduledProgram& scheduled);

}  // namespace retrograde::gradient

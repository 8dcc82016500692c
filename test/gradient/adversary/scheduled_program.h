// Programs for the autoscheduler, and what it is told.
#pragma once

#include <optional>

#include "frontend/schedule/autoschedule_options.h"
#include "gradient/adversary/gradient_pipeline.h"

namespace retrograde::gradient {

struct ScheduledProgram {
  AdversaryProgram program;
  Extents extents = Extents::Constant;
  AutoscheduleOptions told = {};
  bool is_whole = true;  // by Pipeline::auto_schedule(), not what a gradient gets by default
  // Of a large program: the same at sizes that the interpreter can do.
  std::optional<AdversaryProgram> small = {};
};

// UserError: the program is no legal one.
ScheduledProgram make_scheduled(Choices& choices);
std::string to_text(const ScheduledProgram& scheduled);

}  // namespace retrograde::gradient

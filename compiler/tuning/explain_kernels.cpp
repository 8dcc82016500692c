// explain_kernels.cpp -- what the kernels of a schedule take of a device.
#include "autoschedule/choose_schedule.h"
#include "frontend/run/pipeline.h"
#include "tuning/kernels_taken.h"

namespace retrograde {

KernelReport explain_kernels(const Pipeline& pipeline, const Target& target) {
  const PipelineSpec spec = pipeline.spec();
  return tuning::kernels_taken(
      tuning::lower_for_report(spec, autoschedule::choose_schedule(spec, target).graph.outputs,
                               target),
      target);
}

}  // namespace retrograde

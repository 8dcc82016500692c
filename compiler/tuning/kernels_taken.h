// kernels_taken.h -- a scheduled pipeline lowered for a report, and what its kernels take of a device.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "frontend/run/compiled_pipeline.h"
#include "frontend/run/kernel_report.h"
#include "graph/function.h"
#include "ir/lowered_function.h"
#include "lower/device/kernel_loops.h"

namespace retrograde::tuning {

struct LoweredForReport {
  ir::LoweredFunction function;
  std::map<std::string, lower::KernelLoops> kernel_loops;  // by the name of the launch
};
// `scheduled`: the pipeline's outputs with the schedule that was chosen.
LoweredForReport lower_for_report(const PipelineSpec& pipeline,
                                  const std::vector<graph::FuncPtr>& scheduled,
                                  const Target& target);

// No kernels where all of it runs on the host.
KernelReport kernels_taken(const LoweredForReport& lowered, const Target& target);

}  // namespace retrograde::tuning

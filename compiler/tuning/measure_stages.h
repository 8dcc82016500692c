// measure_stages.h -- how long each stage of a program takes, by running it under the profiler.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "frontend/run/compiled_pipeline.h"
#include "frontend/run/schedule_report.h"

namespace retrograde::tuning {

struct MeasuredStages {
  std::map<std::string, double> seconds;  // of one run, by Func; "overhead" is none
  double total_seconds = 0;               // of the fastest run
  double sampled_seconds = 0;             // of all runs, one sample a millisecond
  double peak_bytes = 0;                  // of the memory that a run allocates
};

// `scheduled`: what lowering is given, of the pipeline.
MeasuredStages measure_stages(const PipelineSpec& pipeline,
                              const std::vector<graph::FuncPtr>& scheduled,
                              const std::vector<halide_buffer_t*>& outputs, const Target& target,
                              const ExplainOptions& options, const JITHandlers& handlers);

}  // namespace retrograde::tuning

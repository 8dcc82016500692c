// explain_stages.h -- the stages of a scheduled pipeline in plain words: their loops, what bounds their time, what is
// stored or recomputed, and what a user can change.
//
//   explain_stages(pipeline.spec(), scheduled, target, {{200, 100}}, {{"image", {202, 100}}})
//
// `retrograde.torch` shows the result as op.explain(). Pipeline::explain_schedule gives the numbers alone.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "frontend/run/compiled_pipeline.h"

namespace retrograde::tuning {

// Names are those of Funcs without the numbers that make them unique.
struct ExplainedStage {
  std::string name;
  double ms = 0;      // predicted time of one run
  std::string bound;  // "arithmetic", "memory traffic, 4.1 MB from memory", "a serial chain", ...
  std::vector<std::string> loops;  // a line for each definition (loops_in_words.h)
  std::vector<std::string>
      hints;  // what slows the stage down, and what to write or schedule instead
};
struct StoredFunc {
  std::string name;
  double bytes = 0;
};
struct ExplainedPipeline {
  std::string machine;  // whose figures the predictions use
  int threads = 1;
  double ms = 0;
  std::vector<ExplainedStage> stages;   // slowest first
  std::vector<StoredFunc> stored;       // intermediate results in memory, largest first
  std::vector<std::string> recomputed;  // Funcs that are inlined into their consumers
};

// `scheduled`: the pipeline's outputs with the schedule that was chosen. `output_sizes`: one list for each output, dimension 0 first. `input_sizes`: by the names of images; images that are
// left out have the sizes that are bound, promised or estimated.
// Requires: sizes are given once for all outputs, or for each, one for each dimension.
ExplainedPipeline explain_stages(const PipelineSpec& pipeline,
                                 const std::vector<graph::FuncPtr>& scheduled, const Target& target,
                                 const std::vector<std::vector<int>>& output_sizes,
                                 const std::map<std::string, std::vector<int>>& input_sizes);

// The Func of a stage: copies of a Func at several places have names made of its own, as in "blur.$2" of "blur".
std::string func_of_stage(std::string stage, const std::vector<std::string>& funcs);

}  // namespace retrograde::tuning

// From the description of a pipeline to Funcs, and to C++ text.
#pragma once

#include <string>
#include <vector>

#include "frontend/buffer.h"
#include "frontend/func.h"
#include "frontend/param.h"
#include "testing/array.h"
#include "testing/random_pipeline.h"

namespace retrograde::fuzz {

struct BuiltPipeline {
  std::vector<Buffer<>> images;
  std::vector<Var> vars;  // dimension 0 first: x, y, z
  std::vector<Func> funcs;
  Param<int> selector;  // no part of the pipeline: schedules choose by it
  // Of each update of each Func; an undefined one where the update has no reduction variables.
  std::vector<std::vector<RDom>> domains;
};

BuiltPipeline build(const PipelineSpec& pipeline);

// What the outputs should hold, one Array for each value of each output.
std::vector<oracle::Array> interpret(const std::vector<OutputSpec>& outputs,
                                     const BuiltPipeline& built, oracle::Rounding rounding);

}  // namespace retrograde::fuzz

// From the description of a pipeline to Funcs, and to C++ text.
#pragma once

#include <string>
#include <vector>

#include "frontend/data/buffer.h"
#include "frontend/language/func.h"
#include "testing/array.h"
#include "testing/random_pipeline.h"

namespace retrograde::fuzz {

struct BuiltPipeline {
  std::vector<Buffer<>> images;
  std::vector<Var> vars;  // dimension 0 first: x, y, z
  std::vector<Func> funcs;
};

BuiltPipeline build(const PipelineSpec& pipeline);

// What the outputs should hold, one Array for each value of each output.
std::vector<oracle::Array> interpret(const std::vector<OutputSpec>& outputs,
                                     const BuiltPipeline& built, oracle::Rounding rounding);

}  // namespace retrograde::fuzz

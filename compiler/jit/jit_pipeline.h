// jit_pipeline.h -- compiled code in this process as the front end calls it: the handlers of a call reach the runtime.
#pragma once

#include <memory>

#include "frontend/run/compiled_pipeline.h"
#include "jit/extern_pipelines.h"

namespace retrograde::jit {

// `target`: what the code was compiled for.
std::shared_ptr<CompiledPipeline> make_pipeline(ExternPipeline compiled, const Target& target);

}  // namespace retrograde::jit

// extern_pipelines.h -- Pipelines that extern stages call by name.
//
//   f = blur(user_context, g_buffer, radius, f_buffer)     a call of a C function
//   f = blur(context, user_context, g_buffer, radius, literals..., f_buffer)
//
// The called pipeline is compiled as a function of the runtime's context, user context, images and
// Params in the order of their names, the Buffers that it names itself, and its outputs. Calls hand
// on the context of their caller, so that its handlers serve both, and the Buffers as constants.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "frontend/run/compiler_interface.h"
#include "jit/jit.h"

namespace retrograde::jit {

struct ExternPipeline {
  std::vector<ir::LoweredArgument> arguments;
  std::shared_ptr<const CompiledFunction> code;
  std::map<std::string, struct ExternPipeline> called;  // by its own extern stages
};
using ExternPipelines = std::map<std::string, ExternPipeline>;

ExternPipelines compile_extern_pipelines(const PipelineSpec& caller, const Target& target);

// Requires: a pipeline that is called by name gets its arguments.
Stmt call_pipelines(const Stmt& body, const ExternPipelines& pipelines);

}  // namespace retrograde::jit

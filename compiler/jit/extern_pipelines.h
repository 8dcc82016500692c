// extern_pipelines.h -- compiles Pipelines that extern stages call by name.
//
//   f = blur(user_context, g_buffer, radius, f_buffer)     a call of a C function
//   f = blur(context, user_context, g_buffer, radius, literals..., f_buffer)
//
// The called pipeline becomes a function that takes the runtime's context, the user context, images and Params in the
// order of their names, literal Buffers that the pipeline reads, and its outputs. Calls pass on their caller's context,
// so that its handlers serve both, and pass the literal Buffers as constants.
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
  std::map<std::string, struct ExternPipeline> called;  // called by its own extern stages
};
using ExternPipelines = std::map<std::string, ExternPipeline>;

ExternPipelines compile_extern_pipelines(const PipelineSpec& caller, const Target& target);

// Requires: a call of a pipeline passes all its arguments.
Stmt call_pipelines(const Stmt& body, const ExternPipelines& pipelines);

}  // namespace retrograde::jit

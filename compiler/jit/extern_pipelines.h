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

#include "ir/lowered_function.h"
#include "jit/jit.h"

namespace retrograde::jit {

struct ExternPipeline {
  std::vector<ir::LoweredArgument> arguments;
  std::shared_ptr<const CompiledFunction> code;
  std::map<std::string, struct ExternPipeline> called;  // called by its own extern stages
};
using ExternPipelines = std::map<std::string, ExternPipeline>;

// Compiles a lowered pipeline whose extern stages call the pipelines `called` by their names, and C functions of
// `externs` before those of the process.
// Requires: a call of a pipeline passes all its arguments.
ExternPipeline compile_with_pipelines(ir::LoweredFunction function, ExternPipelines called,
                                      const std::map<std::string, void*>& externs,
                                      const Target& target);

// The arguments of a called pipeline in the order in which its callers pass them.
std::vector<ir::LoweredArgument> in_order_of_calls(std::vector<ir::LoweredArgument> args);

}  // namespace retrograde::jit

// compiler_interface.h -- the interface through which the front end calls the compiler.
//
// A layer may include only lower ones, but f.realize() needs the whole compiler. So the front end declares this
// interface, and compiler/jit implements it in default_compiler().
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "frontend/run/jit_handlers.h"
#include "frontend/run/schedule_report.h"
#include "frontend/schedule/autoschedule_options.h"
#include "graph/directives/schedule_log.h"
#include "graph/function.h"
#include "ir/lowered_function.h"
#include "ir/target.h"

namespace retrograde {

// A pipeline as the compiler takes it.
struct PipelineSpec {
  std::string name;
  std::vector<graph::FuncPtr> outputs;
  std::map<std::string, void*> externs = {};  // C functions by name, before symbols of the process
  bool is_traced = false;                     // whether calls report their begin and end
  AutoscheduleOptions autoschedule = {};      // for Funcs without directives
  // Pipelines by the name under which extern stages call them; see JITExtern.
  std::map<std::string, std::shared_ptr<const PipelineSpec>> pipelines = {};

  Target traced(Target target) const {
    if (is_traced) target.set_feature(Target::TracePipeline);
    return target;
  }
};

// The environment of one call. Handlers may run on several threads at once.
struct CallContext {
  std::function<void(const char*)> print;  // receives text of print(); empty: discarded
  int thread_limit = 0;                    // 0: no limit
  JITHandlers handlers;                    // those that are set replace the runtime's
  JITUserContext* user_context = nullptr;  // passed to handlers; not null if a handler is set
  std::string error;                       // out: message of the error code that run() returned
};

// Compiled code of a pipeline.
class CompiledPipeline {
 public:
  virtual ~CompiledPipeline() = default;
  // Parameters in the order of parameters_of(outputs), then one buffer for each value of each output.
  virtual const std::vector<ir::LoweredArgument>& arguments() const = 0;
  // Runs the code. argv[i] is the halide_buffer_t* of a buffer, or a pointer to a scalar. If an input buffer
  // has neither host nor device memory, the call is a bounds query: it writes the required shapes into such
  // buffers and computes nothing. Returns 0 or an error code, with the message in context.error. Never
  // throws. Thread-safe.
  virtual int run(void* const* argv, CallContext& context) const = 0;
};

// Compilation in process.
class Compiler {
 public:
  virtual ~Compiler() = default;
  // Throws UserError for programs and schedules that cannot be compiled.
  virtual std::shared_ptr<CompiledPipeline> compile(const PipelineSpec& pipeline,
                                                    const Target& target) = 0;
  // The scheduled loops as text.
  virtual std::string loop_nest(const PipelineSpec& pipeline, const Target& target) = 0;
};

Compiler& default_compiler();  // defined by compiler/jit

// Implements Pipeline::explain_schedule; defined by compiler/tuning. Without outputs, sizes are the
// estimates.
ScheduleReport explain_schedule(const PipelineSpec& pipeline,
                                const std::vector<halide_buffer_t*>& outputs, const Target& target,
                                const ExplainOptions& options, const JITHandlers& handlers);

// Predicted run time of a scheduled graph, for a search. Sizes are the estimates; 0 threads means those of
// the machine. Defined by compiler/tuning. Throws what lowering throws.
double predicted_seconds(const std::vector<graph::FuncPtr>& scheduled, const Target& target,
                         int threads);

class Module;
enum class OutputFileType;

// Ahead-of-time compilation behind Module. Compilations may run on several threads at once.
class ModuleCompiler {
 public:
  virtual ~ModuleCompiler() = default;
  // `inputs` are in the caller's order; outputs are appended as the last arguments.
  virtual ir::LoweredFunction lower(const PipelineSpec& pipeline,
                                    const std::vector<ir::LoweredArgument>& inputs,
                                    const Target& target) = 0;
  // The schedule that `lower` uses: the given directives, and those chosen for unscheduled Funcs.
  virtual ScheduleLog schedule(const PipelineSpec& pipeline, const Target& target) = 0;
  virtual std::vector<uint8_t> object(const Module& module) = 0;
  virtual void write(const Module& module,
                     const std::map<OutputFileType, std::string>& output_files) = 0;
  // modules[i] is for targets[i], and its function has a name of its own; the wrapper is called
  // `function_name`. There is one suffix for each target.
  virtual void write_multitarget(const std::string& function_name,
                                 const std::vector<Module>& modules,
                                 const std::vector<std::string>& suffixes,
                                 const std::map<OutputFileType, std::string>& output_files) = 0;
  // Writes a text file completely or not at all.
  virtual void write_text(const std::string& path, const std::string& contents) = 0;
  virtual void write_runtime(const std::map<OutputFileType, std::string>& output_files,
                             const Target& target) = 0;
};

ModuleCompiler& module_compiler();  // defined by compiler/aot

}  // namespace retrograde

// compiler_interface.h -- what the front end asks of the compiler above it.
//
// Layers point down, but f.realize() needs the whole compiler: so the front end names the interface
// here and compiler/jit implements it, in default_compiler().
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "frontend/run/jit_handlers.h"
#include "frontend/run/schedule_report.h"
#include "frontend/schedule/autoschedule_options.h"
#include "graph/function.h"
#include "graph/schedule_log.h"
#include "ir/lowered_function.h"
#include "ir/target.h"

namespace retrograde {

struct PipelineSpec {
  std::string name;
  std::vector<graph::FuncPtr> outputs;
  std::map<std::string, void*> externs = {};  // C functions by name, before those of the process
  bool is_traced = false;                     // a call tells when it begins and ends
  AutoscheduleOptions autoschedule = {};      // for what nobody scheduled
  // Pipelines by the name that extern stages call them by; see JITExtern.
  std::map<std::string, std::shared_ptr<const PipelineSpec>> pipelines = {};

  Target traced(Target target) const {
    if (is_traced) target.set_feature(Target::TracePipeline);
    return target;
  }
};

// One call. Handlers may be called from several threads at once.
struct CallContext {
  std::function<void(const char*)> print;  // text of print() and print_when(); empty: thrown away
  int thread_limit = 0;                    // 0: as many as there are
  JITHandlers handlers;                    // those that are set replace what the runtime does
  JITUserContext* user_context = nullptr;  // for the handlers; not null when one is set
  std::string error;                       // out: the message of the error code that run() returned
};

class CompiledPipeline {
 public:
  virtual ~CompiledPipeline() = default;
  // Parameters in the order of parameters_of(outputs), then the output buffers, one for each value
  // of each output.
  virtual const std::vector<ir::LoweredArgument>& arguments() const = 0;
  // argv[i] is the halide_buffer_t* of a buffer, or points to the value of a scalar. When an input
  // buffer has neither host nor device memory the call writes the shapes that it needs into such
  // buffers and computes nothing. Returns 0 or an error code, with the message in context.error.
  // Never throws. Thread-safe.
  virtual int run(void* const* argv, CallContext& context) const = 0;
};

class Compiler {
 public:
  virtual ~Compiler() = default;
  // UserError for programs and schedules that cannot be compiled.
  virtual std::shared_ptr<CompiledPipeline> compile(const PipelineSpec& pipeline,
                                                    const Target& target) = 0;
  // The loops of the schedule, as text.
  virtual std::string loop_nest(const PipelineSpec& pipeline, const Target& target) = 0;
};

Compiler& default_compiler();  // defined by compiler/jit

// Pipeline::explain_schedule; defined by compiler/tuning. No outputs: as estimates say.
ScheduleReport explain_schedule(const PipelineSpec& pipeline,
                                const std::vector<halide_buffer_t*>& outputs, const Target& target,
                                const ExplainOptions& options, const JITHandlers& handlers);

// Of a graph with its schedule, for a search: by estimates of all sizes. 0 threads: those of the
// machine. Defined by compiler/tuning. Errors: those of lowering.
double predicted_seconds(const std::vector<graph::FuncPtr>& scheduled, const Target& target,
                         int threads);

class Module;
enum class OutputFileType;

// Ahead of time: everything below a Module. Compilations may run on several threads at once.
class ModuleCompiler {
 public:
  virtual ~ModuleCompiler() = default;
  // `inputs` in the caller's order; the outputs are appended as the last arguments.
  virtual ir::LoweredFunction lower(const PipelineSpec& pipeline,
                                    const std::vector<ir::LoweredArgument>& inputs,
                                    const Target& target) = 0;
  // What `lower` schedules it by: the directives given, and those chosen for what nobody scheduled.
  virtual ScheduleLog schedule(const PipelineSpec& pipeline, const Target& target) = 0;
  virtual std::vector<uint8_t> object(const Module& module) = 0;
  virtual void write(const Module& module,
                     const std::map<OutputFileType, std::string>& output_files) = 0;
  // modules[i] is for targets[i] and its function has a name of its own; the wrapper has
  // `function_name`. `suffixes`: one for each target.
  virtual void write_multitarget(const std::string& function_name,
                                 const std::vector<Module>& modules,
                                 const std::vector<std::string>& suffixes,
                                 const std::map<OutputFileType, std::string>& output_files) = 0;
  // A text file, whole or not at all.
  virtual void write_text(const std::string& path, const std::string& contents) = 0;
  virtual void write_runtime(const std::map<OutputFileType, std::string>& output_files,
                             const Target& target) = 0;
};

ModuleCompiler& module_compiler();  // defined by compiler/aot

}  // namespace retrograde

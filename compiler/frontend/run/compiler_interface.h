// compiler_interface.h -- the interface through which the front end calls the compiler.
//
// This is the one call that goes up in the layer diagram: a layer may include only lower ones, but f.realize() needs the
// whole compiler. So the front end declares Compiler, and compiler/driver implements it. Only the front end, generators
// and the driver include this header (tools/check_layers).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "frontend/run/compiled_pipeline.h"
#include "frontend/run/module.h"
#include "frontend/run/schedule_report.h"
#include "graph/directives/schedule_log.h"

namespace retrograde {

// The way from Funcs to code. Compilations may run on several threads at once. Each function throws UserError for
// programs and schedules that cannot be compiled. Those of this class throw Unsupported: no compiler is linked.
class Compiler {
 public:
  using Files = std::map<OutputFileType, std::string>;  // paths by their kind

  virtual ~Compiler() = default;

  // ---- in this process ----
  virtual std::shared_ptr<CompiledPipeline> compile(const PipelineSpec& pipeline,
                                                    const Target& target);
  // The scheduled loops as text.
  virtual std::string loop_nest(const PipelineSpec& pipeline, const Target& target);

  // ---- schedules ----
  // The schedule that is compiled: the given directives, and those chosen for unscheduled Funcs.
  virtual ScheduleLog schedule(const PipelineSpec& pipeline, const Target& target);
  // Without outputs, sizes are the estimates.
  virtual ScheduleReport explain_schedule(const PipelineSpec& pipeline,
                                          const std::vector<halide_buffer_t*>& outputs,
                                          const Target& target, const ExplainOptions& options,
                                          const JITHandlers& handlers);
  virtual KernelReport explain_kernels(const PipelineSpec& pipeline, const Target& target);

  // ---- ahead of time ----
  // `inputs` are in the caller's order; outputs are appended as the last arguments.
  virtual ir::LoweredFunction lower(const PipelineSpec& pipeline,
                                    const std::vector<ir::LoweredArgument>& inputs,
                                    const Target& target);
  virtual std::vector<uint8_t> object(const Module& module);
  virtual void write(const Module& module, const Files& output_files);
  // modules[i] is for targets[i], and its function has a name of its own; the wrapper is called `function_name`. There
  // is one suffix for each target.
  virtual void write_multitarget(const std::string& function_name,
                                 const std::vector<Module>& modules,
                                 const std::vector<std::string>& suffixes,
                                 const Files& output_files);
  virtual void write_runtime(const Files& output_files, const Target& target);
  // Writes a text file completely or not at all.
  virtual void write_text(const std::string& path, const std::string& contents);
};

Compiler& default_compiler();  // defined by compiler/driver

}  // namespace retrograde

// compiler.cpp -- implements the front end's Compiler: schedule, lower, generate code.
#include "aot/files.h"
#include "aot/module_files.h"
#include "driver/reports.h"
#include "driver/schedule.h"
#include "frontend/run/compiler_interface.h"
#include "frontend/run/warnings.h"
#include "graph/directives/schedule_log.h"
#include "jit/jit_pipeline.h"
#include "lower/lower.h"

namespace retrograde {

namespace driver {

namespace {

ir::LoweredFunction lowered(const PipelineSpec& pipeline, const std::string& name,
                            const std::vector<ir::LoweredArgument>& inputs, const Target& target) {
  return schedule_and_lower(pipeline, {pipeline.traced(target), name, inputs});
}

// The pipelines that extern stages call by name.
jit::ExternPipelines compile_called(const PipelineSpec& caller, const Target& target) {
  jit::ExternPipelines result;
  for (const auto& [name, pipeline] : caller.pipelines) {
    ir::LoweredFunction function = lowered(
        *pipeline, name, jit::in_order_of_calls(lower::infer_arguments(pipeline->outputs)), target);
    result[name] = jit::compile_with_pipelines(
        std::move(function), compile_called(*pipeline, target), pipeline->externs, target);
  }
  return result;
}

class Driver : public Compiler {
 public:
  std::shared_ptr<CompiledPipeline> compile(const PipelineSpec& pipeline,
                                            const Target& target) override {
    ir::LoweredFunction function =
        lowered(pipeline, pipeline.name, lower::infer_arguments(pipeline.outputs), target);
    jit::ExternPipeline compiled = jit::compile_with_pipelines(
        std::move(function), compile_called(pipeline, target), pipeline.externs, target);
    for (const std::string& note : compiled.code->notes()) frontend::tell_warning(note);
    return jit::make_pipeline(std::move(compiled), target);
  }

  std::string loop_nest(const PipelineSpec& pipeline, const Target& target) override {
    return lower::loop_nest_text(driver::schedule(pipeline, {target}).graph.outputs);
  }

  ScheduleLog schedule(const PipelineSpec& pipeline, const Target& target) override {
    return graph::schedule_log(driver::schedule(pipeline, {pipeline.traced(target)}).graph.outputs);
  }

  ScheduleReport explain_schedule(const PipelineSpec& pipeline,
                                  const std::vector<halide_buffer_t*>& outputs,
                                  const Target& target, const ExplainOptions& options,
                                  const JITHandlers& handlers) override {
    return driver::explain_schedule(pipeline, outputs, target, options, handlers);
  }

  KernelReport explain_kernels(const PipelineSpec& pipeline, const Target& target) override {
    return driver::explain_kernels(pipeline, target);
  }

  ir::LoweredFunction lower(const PipelineSpec& pipeline,
                            const std::vector<ir::LoweredArgument>& inputs,
                            const Target& target) override {
    aot::check_target(target);
    ir::LoweredFunction function = lowered(pipeline, pipeline.name, inputs, target);
    aot::tell_kernel_notes(function, target);
    return function;
  }

  std::vector<uint8_t> object(const Module& module) override { return aot::object_of(module); }

  void write(const Module& module, const Files& output_files) override {
    aot::write_module(module, output_files);
  }

  void write_multitarget(const std::string& function_name, const std::vector<Module>& modules,
                         const std::vector<std::string>& suffixes,
                         const Files& output_files) override {
    aot::write_multitarget(function_name, modules, suffixes, output_files);
  }

  void write_runtime(const Files& output_files, const Target& target) override {
    aot::write_runtime(output_files, target);
  }

  void write_text(const std::string& path, const std::string& contents) override {
    aot::write_files({{path, contents}});
  }
};

}  // namespace

}  // namespace driver

Compiler& default_compiler() {
  static driver::Driver compiler;
  return compiler;
}

}  // namespace retrograde

// pipeline.cpp -- constructs pipelines and compiles them on demand.
#include "frontend/run/pipeline.h"

#include <algorithm>
#include <iostream>
#include <unordered_set>

#include "frontend/language/func.h"
#include "frontend/run/compiler_interface.h"
#include "frontend/run/pipeline_contents.h"
#include "frontend/run/warnings.h"
#include "graph/directives/give_directive.h"

namespace retrograde {

// ---- construction ----

Pipeline::Pipeline(const Func& output) : Pipeline(std::vector<Func>{output}) {}

Pipeline::Pipeline(const std::vector<Func>& outputs) : contents_(std::make_shared<Contents>()) {
  if (outputs.empty())
    user_error("make a Pipeline", "a Pipeline has at least one output", "it was given none",
               "Give the Funcs that are wanted");
  std::unordered_set<const graph::FuncContents*> seen;
  for (const Func& f : outputs) {
    if (!f.defined()) {
      user_error("make a Pipeline of " + quoted(f.name()), "an output needs a definition",
                 "it has none", "Define it: f(x, y) = ...");
    }
    if (!seen.insert(f.function().get()).second) {
      user_error("make a Pipeline", "its outputs are different Funcs",
                 quoted(f.name()) + " is given twice", "Name each output once");
    }
    contents_->outputs.push_back(f.function());
  }
}

Pipeline::Contents& Pipeline::checked() const {
  if (!contents_)
    user_error("use a Pipeline", "it needs outputs", "it was constructed without any",
               "Construct it: Pipeline p(f)");
  return *contents_;
}

void Pipeline::unscheduled() {
  for (const graph::FuncPtr& f : graph::topological_order(checked().outputs)) {
    if (graph::has_directives(*f)) continue;
    for (int s = 0; s < std::max(f->stage_count(), 1); ++s)
      graph::give_directive({f, s}, graph::Unscheduled{});
  }
}

ScheduleLog Pipeline::schedule_log() const { return graph::schedule_log(checked().outputs); }
void Pipeline::apply_schedule(const ScheduleLog& log) { graph::apply_log(log, checked().outputs); }

PipelineSpec Pipeline::spec() const {
  PipelineSpec result{checked().outputs[0]->name, contents_->outputs};
  for (const auto& [name, called] : contents_->externs) {
    if (called.pipeline().defined())
      result.pipelines[name] = std::make_shared<PipelineSpec>(called.pipeline().spec());
    else
      result.externs[name] = called.extern_c_function().address();
  }
  result.is_traced = contents_->is_traced;
  result.autoschedule = contents_->autoschedule;
  return result;
}

std::vector<Func> Pipeline::outputs() const {
  return ir::mapped(checked().outputs, [&](const graph::FuncPtr& f) { return Func(f); });
}

Func Pipeline::get_func(size_t index) const {
  const std::vector<graph::FuncPtr> order = graph::topological_order(checked().outputs);
  if (index >= order.size()) {
    user_error(text("take Func ", index, " of a Pipeline"), "Funcs are numbered from 0",
               text("it has ", order.size(), " Funcs"), "Give a smaller number");
  }
  return Func(order[index]);
}

JITHandlers& Pipeline::jit_handlers() { return checked().handlers; }

void Pipeline::set_externs(const std::map<std::string, JITExtern>& externs) {
  std::lock_guard lock(checked().mutex);
  contents_->externs = externs;
  contents_->compiled.reset();
}

void Pipeline::set_autoschedule_options(const AutoscheduleOptions& options) {
  std::lock_guard lock(checked().mutex);
  contents_->autoschedule = options;
  contents_->compiled.reset();
}

const std::map<std::string, JITExtern>& Pipeline::externs() const { return checked().externs; }

std::vector<Argument> Pipeline::infer_arguments() const {
  std::vector<Argument> result;
  for (const frontend::ParameterPtr& p : graph::parameters_of(checked().outputs)) {
    if (p->is_literal) continue;  // part of the program, not of its interface
    result.push_back(frontend::argument_of(*p));
  }
  return result;
}

// ---- compiling ----

std::shared_ptr<CompiledPipeline> Pipeline::compiled(const Target& wanted) const {
  Contents& contents = checked();
  std::lock_guard lock(contents.mutex);
  Target target = wanted;
  if (target.has_unknowns())
    target = contents.compiled ? contents.target : get_jit_target_from_environment();
  if (!contents.compiled || !(contents.target == target) || !contents.stamp.is_current()) {
    contents.compiled.reset();
    const PipelineSpec pipeline = spec();
    contents.stamp = frontend::Stamp::of(pipeline);
    contents.compiled = default_compiler().compile(pipeline, target);
    contents.target = target;
    frontend::tell_warnings(contents.outputs, target);
  }
  return contents.compiled;
}

void Pipeline::invalidate_cache() {
  std::lock_guard lock(checked().mutex);
  contents_->compiled.reset();
}

void Pipeline::trace_pipeline() {
  invalidate_cache();
  contents_->is_traced = true;
}

std::string Pipeline::loop_nest(const Target& target) const {
  const PipelineSpec pipeline = spec();
  return default_compiler().loop_nest(
      pipeline, target.has_unknowns() ? get_jit_target_from_environment() : target);
}

void Pipeline::print_loop_nest() const { std::cerr << loop_nest(); }

// ---- the cost of a schedule ----

ScheduleReport Pipeline::explain_schedule(const Target& target, const std::vector<int32_t>& sizes,
                                          const ExplainOptions& options) const {
  std::vector<Buffer<>> buffers;
  if (!sizes.empty()) buffers = make_outputs(sizes, options.measure);
  const RealizationArg outputs(buffers);
  return default_compiler().explain_schedule(
      spec(), outputs.buffers(), target.has_unknowns() ? get_jit_target_from_environment() : target,
      options, contents_->handlers);
}

ScheduleReport Pipeline::explain_schedule(const RealizationArg& outputs, const Target& target,
                                          const ExplainOptions& options) const {
  return default_compiler().explain_schedule(
      spec(), checked_outputs(outputs, options.measure),
      target.has_unknowns() ? get_jit_target_from_environment() : target, options,
      contents_->handlers);
}

KernelReport explain_kernels(const Pipeline& pipeline, const Target& target) {
  return default_compiler().explain_kernels(pipeline.spec(), target);
}

}  // namespace retrograde

// pipeline.h -- Pipeline: one or more output Funcs that are compiled and run together.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frontend/data/argument.h"
#include "frontend/data/realization.h"
#include "frontend/run/compiled_pipeline.h"
#include "frontend/run/jit_handlers.h"
#include "frontend/run/module.h"
#include "frontend/run/param_map.h"
#include "frontend/run/runnable.h"
#include "frontend/run/schedule_report.h"
#include "frontend/schedule/autoschedule_options.h"
#include "frontend/schedule/autoscheduler.h"
#include "graph/directives/schedule_log.h"

namespace retrograde {

class Callable;
class Func;

struct JITExtern;

// One or more output Funcs that are compiled and run together.
// Requires: it needs outputs.
class Pipeline : public Runnable<Pipeline> {
 public:
  // The buffers that realize() computes into.
  using RealizationArg = retrograde::RealizationArg;

  Pipeline() = default;  // a pipeline without outputs
  // A pipeline with one output.
  Pipeline(const Func& output);
  // A pipeline with several outputs.
  // Requires: a Pipeline has at least one output; an output needs a definition; its outputs are
  // different Funcs; Funcs may not depend on each other in a circle; every Func that is used needs
  // a definition; parameters of one pipeline have different names.
  Pipeline(const std::vector<Func>& outputs);

  bool defined() const { return contents_ != nullptr; }  // whether it has outputs
  std::vector<Func> outputs() const;                     // the outputs in the given order
  // Func `index` of all Funcs of the pipeline, producers before consumers.
  // Requires: Funcs are numbered from 0.
  Func get_func(size_t index) const;

  void invalidate_cache();  // discards the compiled code
  // Reports the begin and end of each call to the trace handler.
  void trace_pipeline();
  std::string loop_nest(const Target& target = Target()) const;  // the scheduled loops as text
  void print_loop_nest() const;                   // prints the scheduled loops to stderr
  std::vector<Argument> infer_arguments() const;  // Params and ImageParams that it uses
  JITHandlers& jit_handlers();                    // handlers of in-process calls

  // Makes calls fail with the message unless the condition holds. The condition and the parts of the message
  // may use Params and sizes of images, but neither Funcs nor Vars. The requirement belongs to the first
  // output and applies to every pipeline that has it among its outputs.
  // Requires: a requirement is checked once, before anything is computed; a requirement is a
  // condition of type bool; every part of its message is a defined expression.
  void add_requirement(const Expr& condition, const std::vector<Expr>& message);
  template <typename... Parts>
  requires(std::constructible_from<Expr, Parts>&&...) void add_requirement(const Expr& condition,
                                                                           Parts&&... message) {
    add_requirement(condition, std::vector<Expr>{Expr(std::forward<Parts>(message))...});
  }

  // ---- automatic schedules; see autoscheduler.h ----

  // Schedules the pipeline with the autoscheduler `name`, or with the default one.
  AutoSchedulerResults auto_schedule(const std::string& name, const Target& target,
                                     const MachineParams& machine = {}) const;
  AutoSchedulerResults auto_schedule(const Target& target, const MachineParams& machine = {}) const;
  // Schedules the pipeline with the built-in autoscheduler and the given options.
  // Requires: options of the autoscheduler name Funcs of the pipeline; a Func is stored or inlined;
  // what is inlined has one pure definition and is no output; what is inlined stays small enough to
  // compile; what is stored has bounds that are known.
  AutoSchedulerResults auto_schedule(const Target& target, const AutoscheduleOptions& options,
                                     const MachineParams& machine = {}) const;
  // Schedules the pipeline with an autoscheduler that is selected and configured by name and text.
  // Requires: the built-in autoscheduler takes parameters of the machine.
  AutoSchedulerResults apply_autoscheduler(const Target& target,
                                           const AutoschedulerParams& params) const;
  // Keeps the compiler from scheduling Funcs without directives; gradients are then inlined into their
  // consumers too.
  void unscheduled();
  // Registers an autoscheduler under a name.
  static void add_autoscheduler(const std::string& name, const AutoSchedulerFn& scheduler) {
    retrograde::add_autoscheduler(name, scheduler);
  }
  template <typename F>
  requires(std::is_invocable_v<
           F, const Pipeline&, const Target&, const AutoschedulerParams&,
           AutoSchedulerResults*>) static void add_autoscheduler(const std::string& name,
                                                                 const F& scheduler) {
    retrograde::add_autoscheduler(name, scheduler);
  }
  // Selects the autoscheduler that auto_schedule() without a name uses.
  static void set_default_autoscheduler_name(const std::string& name) {
    retrograde::set_default_autoscheduler_name(name);
  }

  // ---- schedules as values; see schedule_log.h ----
  ScheduleLog schedule_log() const;  // all directives of its Funcs, in order
  // Applies the directives of a log to the Funcs of the same names.
  // Requires: every Func that it names is one of the program; every image that it names is one of
  // the program; the target of a directive exists.
  void apply_schedule(const ScheduleLog& log);

  // ---- the cost of a schedule; see schedule_report.h ----

  // Reports the cost of the schedule per stage, for outputs over [0, size) in each dimension. All outputs
  // have one shape; without sizes their estimates are used.
  // Requires: it takes one size for each dimension (RuntimeError); sizes are not negative
  // (RuntimeError).
  ScheduleReport explain_schedule(const Target& target = Target(),
                                  const std::vector<int32_t>& sizes = {},
                                  const ExplainOptions& options = {}) const;
  // Reports the cost for the given output buffers; measurements write into them.
  ScheduleReport explain_schedule(const RealizationArg& outputs, const Target& target = Target(),
                                  const ExplainOptions& options = {}) const;

  // The pipeline as the compiler takes it.
  PipelineSpec spec() const;

 private:
  friend class Runnable<Pipeline>;
  friend class Runnable<Func>;
  Pipeline& pipeline_to(const char*) { return *this; }

  struct Contents;
  Contents& checked() const;
  std::shared_ptr<CompiledPipeline> compiled(const Target& target) const;
  Callable callable(const std::vector<Argument>& args, const Target& target);
  Module module(const std::vector<Argument>& args, const std::string& function_name,
                const Target& target, LinkageType linkage) const;
  void set_externs(const std::map<std::string, JITExtern>& externs);
  void set_autoschedule_options(const AutoscheduleOptions& options);
  const std::map<std::string, JITExtern>& externs() const;
  std::vector<Buffer<>> make_outputs(const std::vector<int32_t>& sizes, bool with_memory) const;
  std::vector<halide_buffer_t*> checked_outputs(const RealizationArg& outputs,
                                                bool with_memory) const;
  // The outputs are computed over [0, size) in each dimension, or over the given buffers.
  Realization run(JITUserContext* context, const std::vector<int32_t>& sizes, const Target& target,
                  const ParamMap& map) const;
  void run(JITUserContext* context, const RealizationArg& outputs, const Target& target,
           const ParamMap& map) const;
  void infer(JITUserContext* context, const std::vector<int32_t>& sizes, const Target& target,
             const ParamMap& map) const;
  void infer(JITUserContext* context, const RealizationArg& outputs, const Target& target,
             const ParamMap& map) const;
  void infer(JITUserContext* context, const std::vector<halide_buffer_t*>& outputs,
             const Target& target, const ParamMap& map) const;

  std::shared_ptr<Contents> contents_;
};

// The implementation of a C name that a pipeline calls: a C function, or a Pipeline, which is compiled with
// the caller and computes an extern stage. A Pipeline takes user_context_value(), which may be omitted, then
// the images that it uses, then its Params, each sorted by name, then its outputs:
//   blur: uses the ImageParam "in" and the Param "radius"
//   f.define_extern("blur", {user_context_value(), g, radius}, Float(32), 2);
//   f.set_jit_externs({{"blur", JITExtern(blur)}});
struct JITExtern {
  // A pipeline as the implementation.
  // Requires: it needs outputs; a call of a pipeline passes all its arguments.
  explicit JITExtern(Pipeline pipeline);
  explicit JITExtern(const Func& func);
  // A C function as the implementation.
  explicit JITExtern(ExternCFunction function) : function_(std::move(function)) {}
  template <typename R, typename... Args>
  explicit JITExtern(R (*f)(Args...)) : JITExtern(ExternCFunction(f)) {}
  const Pipeline& pipeline() const { return pipeline_; }  // the pipeline, or an undefined one
  // The C function, if it is one.
  const ExternCFunction& extern_c_function() const { return function_; }

 private:
  Pipeline pipeline_;
  ExternCFunction function_;
};

}  // namespace retrograde

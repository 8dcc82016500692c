// pipeline.h -- one or more output Funcs, compiled and run together.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frontend/data/argument.h"
#include "frontend/data/realization.h"
#include "frontend/run/compiler_interface.h"
#include "frontend/run/jit_handlers.h"
#include "frontend/run/module.h"
#include "frontend/run/param_map.h"
#include "frontend/run/runnable.h"
#include "frontend/run/schedule_report.h"
#include "frontend/schedule/autoschedule_options.h"
#include "frontend/schedule/autoscheduler.h"
#include "graph/schedule_log.h"

namespace retrograde {

class Callable;
class Func;

struct JITExtern;

// Requires: it needs outputs.
class Pipeline : public Runnable<Pipeline> {
 public:
  using RealizationArg = retrograde::RealizationArg;

  Pipeline() = default;
  Pipeline(const Func& output);
  // Requires: a Pipeline has at least one output; an output needs a definition; its outputs are
  // different Funcs; Funcs may not depend on each other in a circle; every Func that is used needs
  // a definition; parameters of one pipeline have different names.
  Pipeline(const std::vector<Func>& outputs);

  bool defined() const { return contents_ != nullptr; }  // whether it has outputs
  std::vector<Func> outputs() const;                     // in the order given
  // Requires: Funcs are numbered from 0.
  Func get_func(size_t index) const;  // of all Funcs, producers first

  void invalidate_cache();  // forgets what was compiled
  // Tells the trace handler when a call begins and when it ends.
  void trace_pipeline();
  std::string loop_nest(const Target& target = Target()) const;  // its loops, after scheduling
  void print_loop_nest() const;                                  // to the standard error stream
  std::vector<Argument> infer_arguments() const;  // Params and ImageParams that it uses
  JITHandlers& jit_handlers();                    // what its compiled code calls back

  // Calls fail with the message, whose parts may be Exprs, unless the condition holds. It may use
  // Params and sizes of images, but no Func and no Var; it holds for every pipeline that has the
  // first output among its outputs.
  // Requires: a requirement is checked once, before anything is computed; a requirement is a
  // condition of type bool; every part of its message is a defined expression.
  void add_requirement(const Expr& condition, const std::vector<Expr>& message);
  template <typename... Parts>
  requires(std::constructible_from<Expr, Parts>&&...) void add_requirement(const Expr& condition,
                                                                           Parts&&... message) {
    add_requirement(condition, std::vector<Expr>{Expr(std::forward<Parts>(message))...});
  }

  // ---- automatic schedules; see autoscheduler.h ----
  AutoSchedulerResults auto_schedule(const std::string& name, const Target& target,
                                     const MachineParams& machine = {}) const;
  AutoSchedulerResults auto_schedule(const Target& target, const MachineParams& machine = {}) const;
  // By the built-in one, which these options say more to.
  // Requires: options of the autoscheduler name Funcs of the pipeline; a Func is stored or inlined;
  // what is inlined has one pure definition and is no output; what is inlined stays small enough to
  // compile; what is stored has bounds that are known.
  AutoSchedulerResults auto_schedule(const Target& target, const AutoscheduleOptions& options,
                                     const MachineParams& machine = {}) const;
  // By name, with what the scheduler is told: see AutoschedulerParams.
  // Requires: the built-in autoscheduler is told of the machine.
  AutoSchedulerResults apply_autoscheduler(const Target& target,
                                           const AutoschedulerParams& params) const;
  // Its Funcs that got no directive stay without: gradients are computed where they are read, too.
  void unscheduled();
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
  static void set_default_autoscheduler_name(const std::string& name) {
    retrograde::set_default_autoscheduler_name(name);
  }

  // ---- schedules as values; see schedule_log.h ----
  ScheduleLog schedule_log() const;  // what was given to its Funcs, in the order given
  // Gives all of a log to the Funcs of the same names.
  // Requires: every Func that it names is one of the program; every image that it names is one of
  // the program; the target of a directive exists.
  void apply_schedule(const ScheduleLog& log);

  // ---- what a schedule costs; see schedule_report.h ----
  // For outputs over [0, size) in each dimension, all of one shape; without sizes, as their
  // estimates say.
  // Requires: it takes one size for each dimension (RuntimeError); sizes are not negative
  // (RuntimeError).
  ScheduleReport explain_schedule(const Target& target = Target(),
                                  const std::vector<int32_t>& sizes = {},
                                  const ExplainOptions& options = {}) const;
  // For such buffers, into which it is run where times are measured.
  ScheduleReport explain_schedule(const RealizationArg& outputs, const Target& target = Target(),
                                  const ExplainOptions& options = {}) const;

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
  // Over [0, size) in each dimension, or over the given buffers.
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

// A C function behind a name that a pipeline calls; or a Pipeline, compiled with it, that an extern
// stage calls. It takes user_context_value(), which may be left out, then what it uses of images,
// then of Params, each in the order of their names, then its outputs:
//   blur: uses the ImageParam "in" and the Param "radius"
//   f.define_extern("blur", {user_context_value(), g, radius}, Float(32), 2);
//   f.set_jit_externs({{"blur", JITExtern(blur)}});
struct JITExtern {
  // Requires: it needs outputs; a pipeline that is called by name gets its arguments.
  explicit JITExtern(Pipeline pipeline);
  explicit JITExtern(const Func& func);
  explicit JITExtern(ExternCFunction function) : function_(std::move(function)) {}
  template <typename R, typename... Args>
  explicit JITExtern(R (*f)(Args...)) : JITExtern(ExternCFunction(f)) {}
  const Pipeline& pipeline() const { return pipeline_; }
  const ExternCFunction& extern_c_function() const { return function_; }

 private:
  Pipeline pipeline_;
  ExternCFunction function_;
};

}  // namespace retrograde

// pipeline.h -- one or more output Funcs, compiled and run together.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "frontend/data/argument.h"
#include "frontend/data/realization.h"
#include "frontend/run/compiler_interface.h"
#include "frontend/run/jit_handlers.h"
#include "frontend/run/module.h"
#include "frontend/run/param_map.h"
#include "frontend/schedule/autoscheduler.h"
#include "graph/schedule_log.h"

namespace retrograde {

class Callable;
class Func;

struct JITExtern;

// Requires: it needs outputs.
class Pipeline {
 public:
  // Buffers to compute into: one, several in braces, a Realization, or one of the runtime.
  class RealizationArg {
   public:
    RealizationArg(Realization& realization);
    RealizationArg(Realization&& realization) : RealizationArg(realization) {}
    RealizationArg(halide_buffer_t* buffer) : raw_{buffer} {}
    RealizationArg(std::vector<Buffer<>> buffers);
    template <typename T, int Dims, int Storage>
    RealizationArg(Runtime::Buffer<T, Dims, Storage>& buffer) : raw_{buffer.raw_buffer()} {
      static_assert(!std::is_const_v<T>, "an output cannot be a Buffer of const elements");
    }
    template <typename T, int Dims>
    RealizationArg(const Buffer<T, Dims>& buffer) : RealizationArg(std::vector<Buffer<>>{buffer}) {
      static_assert(!std::is_const_v<T>, "an output cannot be a Buffer of const elements");
    }
    template <typename T, int Dims, typename... Rest>
    requires(sizeof...(Rest) >= 1 && (std::is_convertible_v<Rest, Buffer<>> && ...))
        RealizationArg(const Buffer<T, Dims>& first, Rest&&... rest)
        : RealizationArg(std::vector<Buffer<>>{first, Buffer<>(std::forward<Rest>(rest))...}) {}
    const std::vector<halide_buffer_t*>& buffers() const { return raw_; }

   private:
    std::vector<Buffer<>> owners_;
    std::vector<halide_buffer_t*> raw_;
  };

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

  // Computes all outputs over [0, size) in each dimension, into new buffers. Parameters have their
  // values from the map before those that were set.
  // Requires: it takes one size for each dimension (RuntimeError); sizes are not negative
  // (RuntimeError); custom_malloc and custom_free come together.
  Realization realize(const std::vector<int32_t>& sizes = {}, const Target& target = Target(),
                      const ParamMap& map = ParamMap::empty_map());
  Realization realize(std::initializer_list<int32_t> sizes, const Target& target = Target(),
                      const ParamMap& map = ParamMap::empty_map()) {
    return realize(std::vector<int32_t>(sizes), target, map);
  }
  // Computes all outputs over the given buffers.
  // Requires: the buffers of one Func cover one region (RuntimeError); it takes one buffer for each
  // value of each output (RuntimeError); the Param must keep its limits (RuntimeError); the Param
  // needs a value (RuntimeError); the ImageParam needs a buffer (RuntimeError); a buffer must not
  // be null (RuntimeError); it must have the right element type (RuntimeError); it must have the
  // right number of dimensions (RuntimeError); it must not have negative extents (RuntimeError); it
  // must have memory (RuntimeError); the compiled code must succeed (RuntimeError); the JIT runs
  // code on this machine (Unsupported); a C function that it calls must be in this process, or
  // among its JIT externs.
  void realize(RealizationArg outputs, const Target& target = Target(),
               const ParamMap& map = ParamMap::empty_map());
  // The same; the handlers of `context` go before those of jit_handlers().
  Realization realize(JITUserContext* context, const std::vector<int32_t>& sizes = {},
                      const Target& target = Target(), const ParamMap& map = ParamMap::empty_map());
  void realize(JITUserContext* context, RealizationArg outputs, const Target& target = Target(),
               const ParamMap& map = ParamMap::empty_map());
  // Gives every ImageParam without a buffer one of exactly the region that the outputs need; those
  // of the map, whose Buffers it makes, keep their own.
  // Requires: the regions of the inputs must settle (RuntimeError); the region that a pipeline
  // reads of its input must be bounded.
  void infer_input_bounds(const std::vector<int32_t>& sizes, const Target& target = Target(),
                          const ParamMap& map = ParamMap::empty_map());
  void infer_input_bounds(RealizationArg outputs, const Target& target = Target(),
                          const ParamMap& map = ParamMap::empty_map());
  void infer_input_bounds(JITUserContext* context, const std::vector<int32_t>& sizes,
                          const Target& target = Target(),
                          const ParamMap& map = ParamMap::empty_map());
  void infer_input_bounds(JITUserContext* context, RealizationArg outputs,
                          const Target& target = Target(),
                          const ParamMap& map = ParamMap::empty_map());
  // Compiles now what realize would compile on its first call.
  // Requires: this program must be linked with the compiler (Unsupported).
  void compile_jit(const Target& target = Target());
  // A function of `args`, in their order, then the output buffers; see callable.h.
  // Requires: its arguments are all that the outputs need.
  Callable compile_to_callable(const std::vector<Argument>& args,
                               const Target& target = get_jit_target_from_environment());
  void invalidate_cache();  // forgets what was compiled
  // Tells the trace handler when a call begins and when it ends.
  void trace_pipeline();
  // Its loops as text, after scheduling.
  std::string loop_nest(const Target& target = Target()) const;
  void print_loop_nest() const;                   // to the standard error stream
  std::vector<Argument> infer_arguments() const;  // Params and ImageParams that it uses
  JITHandlers& jit_handlers();                    // what its compiled code calls back
  void set_error_handler(void (*handler)(void*, const char*));
  // Requires: allocation and release come together.
  void set_custom_allocator(void* (*malloc)(void*, size_t), void (*free)(void*, void*));
  void set_custom_do_task(int (*handler)(void*, int (*)(void*, int, uint8_t*), int, uint8_t*));
  void set_custom_do_par_for(int (*handler)(void*, int (*)(void*, int, uint8_t*), int, int,
                                            uint8_t*));
  void set_custom_trace(int (*handler)(void*, const halide_trace_event_t*));
  void set_custom_print(void (*handler)(void*, const char*));
  // What the C functions that the pipeline calls by name are; others are looked up in the process.
  // Requires: what a pipeline calls by name is a C function (Unsupported).
  void set_jit_externs(const std::map<std::string, JITExtern>& externs);
  const std::map<std::string, JITExtern>& get_jit_externs();

  // ---- ahead of time ----
  // What the function takes is `args`, in their order, then the output buffers.
  // Requires: a function's name is an identifier of C; C functions have no namespace; the list of
  // arguments holds inputs, and outputs follow by themselves; every argument is listed once; an
  // argument is what the pipeline uses under its name; the list of arguments holds every Param and
  // ImageParam that it uses; a Buffer that is no argument is embedded with its data.
  Module compile_to_module(const std::vector<Argument>& args, const std::string& function_name,
                           const Target& target = get_target_from_environment(),
                           LinkageType linkage = LinkageType::ExternalPlusMetadata);
  void compile_to(const std::map<OutputFileType, std::string>& output_files,
                  const std::vector<Argument>& args, const std::string& function_name,
                  const Target& target);
  void compile_to_object(const std::string& filename, const std::vector<Argument>& args,
                         const std::string& function_name,
                         const Target& target = get_target_from_environment());
  void compile_to_bitcode(const std::string& filename, const std::vector<Argument>& args,
                          const std::string& function_name,
                          const Target& target = get_target_from_environment());
  void compile_to_llvm_assembly(const std::string& filename, const std::vector<Argument>& args,
                                const std::string& function_name,
                                const Target& target = get_target_from_environment());
  void compile_to_assembly(const std::string& filename, const std::vector<Argument>& args,
                           const std::string& function_name,
                           const Target& target = get_target_from_environment());
  void compile_to_header(const std::string& filename, const std::vector<Argument>& args,
                         const std::string& function_name,
                         const Target& target = get_target_from_environment());
  void compile_to_c(const std::string& filename, const std::vector<Argument>& args,
                    const std::string& function_name,
                    const Target& target = get_target_from_environment());  // Unsupported
  // HTML: schedule, loops and machine code side by side.
  void compile_to_lowered_stmt(const std::string& filename, const std::vector<Argument>& args,
                               StmtOutputFormat format = Text,
                               const Target& target = get_target_from_environment());
  // prefix.o, with the runtime unless the target says no_runtime, and prefix.h
  void compile_to_file(const std::string& filename_prefix, const std::vector<Argument>& args,
                       const std::string& function_name,
                       const Target& target = get_target_from_environment());
  // prefix.a, with the runtime unless the target says no_runtime, and prefix.h
  void compile_to_static_library(const std::string& filename_prefix,
                                 const std::vector<Argument>& args,
                                 const std::string& function_name,
                                 const Target& target = get_target_from_environment());
  // The first target that the machine can run decides at run time; see compile_multitarget.
  void compile_to_multitarget_static_library(const std::string& filename_prefix,
                                             const std::vector<Argument>& args,
                                             const std::vector<Target>& targets);
  void compile_to_multitarget_object_files(const std::string& filename_prefix,
                                           const std::vector<Argument>& args,
                                           const std::vector<Target>& targets,
                                           const std::vector<std::string>& suffixes);

  // Calls fail with the message, whose parts may be Exprs, unless the condition holds. It may use
  // Params and sizes of images, but no Func and no Var; it holds for every pipeline that has the
  // first output among its outputs.
  // Requires: a requirement is checked once, before anything is computed; a requirement is a
  // condition of type bool; every part of its message is a defined expression.
  void add_requirement(const Expr& condition, const std::vector<Expr>& message);
  template <typename... Parts>
  requires((std::is_convertible_v<Parts, Expr> && ...)) void add_requirement(const Expr& condition,
                                                                             Parts&&... message) {
    add_requirement(condition, std::vector<Expr>{Expr(std::forward<Parts>(message))...});
  }

  // ---- automatic schedules; see autoscheduler.h ----
  AutoSchedulerResults auto_schedule(const std::string& name, const Target& target,
                                     const MachineParams& machine = {}) const;
  AutoSchedulerResults auto_schedule(const Target& target, const MachineParams& machine = {}) const;
  static void add_autoscheduler(const std::string& name, const AutoSchedulerFn& scheduler) {
    retrograde::add_autoscheduler(name, scheduler);
  }
  static void set_default_autoscheduler_name(const std::string& name) {
    retrograde::set_default_autoscheduler_name(name);
  }

  // ---- schedules as values; see schedule_log.h ----
  ScheduleLog schedule_log() const;  // what was given to its Funcs, in the order given
  // Gives all of a log to the Funcs of the same names.
  // Requires: every Func that it names is one of the program; what a directive is given to is
  // there.
  void apply_schedule(const ScheduleLog& log);

  PipelineSpec spec() const;

 private:
  struct Contents;
  Contents& checked() const;
  std::shared_ptr<CompiledPipeline> compiled(const Target& target) const;
  std::vector<Buffer<>> make_outputs(const std::vector<int32_t>& sizes, bool with_memory) const;
  std::vector<halide_buffer_t*> checked_outputs(const RealizationArg& outputs,
                                                bool with_memory) const;
  void run(const std::vector<halide_buffer_t*>& outputs, const Target& target,
           JITUserContext* context, const ParamMap& map) const;
  void infer(const std::vector<halide_buffer_t*>& outputs, const Target& target,
             JITUserContext* context, const ParamMap& map) const;

  std::shared_ptr<Contents> contents_;
};

// A C function behind a name that a pipeline calls.
struct JITExtern {
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

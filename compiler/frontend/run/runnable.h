// runnable.h -- running and compiling, for Pipelines and for Funcs, which are pipelines with one output.
#pragma once

#include <initializer_list>
#include <map>
#include <string>
#include <vector>

#include "frontend/data/argument.h"
#include "frontend/data/realization.h"
#include "frontend/run/callable.h"
#include "frontend/run/jit_handlers.h"
#include "frontend/run/module.h"
#include "frontend/run/param_map.h"
#include "frontend/schedule/autoschedule_options.h"

namespace retrograde {

struct JITExtern;

// The output buffers of a call: a Buffer, several in braces, a Realization, or a runtime buffer.
class RealizationArg {
 public:
  // Converts any of these.
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
  // One buffer per value of each output.
  const std::vector<halide_buffer_t*>& buffers() const { return raw_; }

 private:
  std::vector<Buffer<>> owners_;
  std::vector<halide_buffer_t*> raw_;
};

namespace frontend {

// Handlers of Halide's older interface take the context as a void*; calls are the same.
template <typename To, typename From>
void set_handler(To& handler, From* function) {
  handler = reinterpret_cast<To>(function);
}
void check_allocator(bool allocates, bool frees);

// File names for `prefix`: the given kind of file, and a header next to it.
std::map<OutputFileType, std::string> file_and_header(OutputFileType type,
                                                      const std::string& prefix,
                                                      const Target& target);
// Names the function after the last part of the prefix, as Halide does.
void compile_multitarget(OutputFileType type, const std::string& prefix,
                         const std::vector<Target>& targets,
                         const std::vector<std::string>& suffixes, const ModuleFactory& make);

}  // namespace frontend

// The operations that Pipeline and Func share: run in process, compile to files, set handlers.
template <class Self>
class Runnable {
  using Files = std::map<OutputFileType, std::string>;
  using Args = std::vector<Argument>;

 public:
  // Computes all outputs over [0, size) in each dimension, into new buffers. Values of parameters come from `map`, or
  // else from the parameters themselves.
  // Requires: it takes one size for each dimension (RuntimeError); sizes are not negative
  // (RuntimeError); custom_malloc and custom_free come together.
  Realization realize(const std::vector<int32_t>& sizes = {}, const Target& target = Target(),
                      const ParamMap& map = ParamMap::empty_map()) {
    return realize(nullptr, sizes, target, map);
  }
  // For braced lists, so that {0} is a size and not a null pointer.
  Realization realize(std::initializer_list<int32_t> sizes, const Target& target = Target(),
                      const ParamMap& map = ParamMap::empty_map()) {
    return realize(std::vector<int32_t>(sizes), target, map);
  }
  // Computes all outputs over the regions of the given buffers.
  // Requires: the buffers of one Func cover one region (RuntimeError); it takes one buffer for each
  // value of each output (RuntimeError); the Param must keep its limits (RuntimeError); the Param
  // needs a value (RuntimeError); the ImageParam needs a buffer (RuntimeError); a buffer must not
  // be null (RuntimeError); it must have the right element type (RuntimeError); it must have the
  // right number of dimensions (RuntimeError); it must not have negative extents (RuntimeError); it
  // must have memory (RuntimeError); the compiled code must succeed (RuntimeError); the JIT runs
  // code on this machine (Unsupported); a C function that it calls must be in this process, or
  // among its JIT externs.
  void realize(RealizationArg outputs, const Target& target = Target(),
               const ParamMap& map = ParamMap::empty_map()) {
    realize(nullptr, std::move(outputs), target, map);
  }
  // Passes `context` to the handlers; its own handlers take precedence over those of jit_handlers().
  Realization realize(JITUserContext* context, const std::vector<int32_t>& sizes = {},
                      const Target& target = Target(),
                      const ParamMap& map = ParamMap::empty_map()) {
    return pipeline_to("realize ").run(context, sizes, target, map);
  }
  void realize(JITUserContext* context, RealizationArg outputs, const Target& target = Target(),
               const ParamMap& map = ParamMap::empty_map()) {
    pipeline_to("realize ").run(context, outputs, target, map);
  }
  // Binds a new buffer, of exactly the region that the outputs require, to every ImageParam without one. For an
  // ImageParam in `map` the new buffer goes to the map's Buffer instead. Outputs without memory are enlarged to the
  // region that the pipeline writes. Since regions may depend on each other and on themselves, bounds queries are
  // repeated until no region changes.
  // Requires: the regions of buffers settle within 64 bounds queries (RuntimeError); the region that
  // a pipeline reads of its input must be bounded.
  void infer_input_bounds(const std::vector<int32_t>& sizes, const Target& target = Target(),
                          const ParamMap& map = ParamMap::empty_map()) {
    infer_input_bounds(nullptr, sizes, target, map);
  }
  void infer_input_bounds(RealizationArg outputs, const Target& target = Target(),
                          const ParamMap& map = ParamMap::empty_map()) {
    infer_input_bounds(nullptr, std::move(outputs), target, map);
  }
  void infer_input_bounds(JITUserContext* context, const std::vector<int32_t>& sizes,
                          const Target& target = Target(),
                          const ParamMap& map = ParamMap::empty_map()) {
    pipeline_to("infer the input bounds of ").infer(context, sizes, target, map);
  }
  void infer_input_bounds(JITUserContext* context, RealizationArg outputs,
                          const Target& target = Target(),
                          const ParamMap& map = ParamMap::empty_map()) {
    pipeline_to("infer the input bounds of ").infer(context, outputs, target, map);
  }
  // Compiles the code that realize() would compile on its first call.
  // Requires: this program must be linked with the compiler (Unsupported).
  void compile_jit(const Target& target = Target()) { pipeline_to("compile ").compiled(target); }
  // Compiles to a function object that takes `args` in order, then the output buffers; see callable.h.
  // Requires: its arguments are all that the outputs need.
  Callable compile_to_callable(const Args& args,
                               const Target& target = get_jit_target_from_environment()) {
    return pipeline_to("compile ").callable(args, target);
  }

  // Sets the options for later compilations of gradients without directives, and for auto_schedule() without
  // options of its own. To prevent automatic schedules, call Pipeline::unscheduled().
  void set_autoschedule(const AutoscheduleOptions& options) {
    pipeline_to("set options of the autoscheduler for ").set_autoschedule_options(options);
  }

  // ---- handlers that compiled code calls; see jit_handlers.h ----

  // Sets JITHandlers::custom_error.
  void set_error_handler(void (*handler)(void*, const char*)) {
    frontend::set_handler(handlers().custom_error, handler);
  }
  // Sets JITHandlers::custom_malloc and custom_free.
  // Requires: allocation and release come together.
  void set_custom_allocator(void* (*malloc)(void*, size_t), void (*free)(void*, void*)) {
    frontend::check_allocator(malloc, free);
    frontend::set_handler(handlers().custom_malloc, malloc);
    frontend::set_handler(handlers().custom_free, free);
  }
  // Sets JITHandlers::custom_do_task.
  void set_custom_do_task(int (*handler)(void*, int (*)(void*, int, uint8_t*), int, uint8_t*)) {
    frontend::set_handler(handlers().custom_do_task, handler);
  }
  // Sets JITHandlers::custom_do_par_for.
  void set_custom_do_par_for(int (*handler)(void*, int (*)(void*, int, uint8_t*), int, int,
                                            uint8_t*)) {
    frontend::set_handler(handlers().custom_do_par_for, handler);
  }
  // Sets JITHandlers::custom_trace.
  void set_custom_trace(int (*handler)(void*, const halide_trace_event_t*)) {
    frontend::set_handler(handlers().custom_trace, handler);
  }
  // Sets JITHandlers::custom_print.
  void set_custom_print(void (*handler)(void*, const char*)) {
    frontend::set_handler(handlers().custom_print, handler);
  }
  // Sets the implementations of C functions that the pipeline calls by name. Other names are symbols of the
  // process.
  void set_jit_externs(const std::map<std::string, JITExtern>& externs) {
    pipeline_to("call C functions from ").set_externs(externs);
  }
  // The implementations that set_jit_externs() was given.
  const std::map<std::string, JITExtern>& get_jit_externs() {
    return pipeline_to("call C functions from ").externs();
  }

  // ---- ahead of time ----

  // Compiles to a function that takes `args` in order, then the output buffers. An empty name means that of
  // the first output.
  // Requires: a function's name is an identifier of C; C functions have no namespace; the list of arguments
  // holds inputs, and outputs are appended automatically; every argument is listed once; an argument agrees
  // with what the pipeline uses under its name; the list of arguments holds every Param and ImageParam that
  // it uses; a Buffer that is not an argument has data.
  Module compile_to_module(const Args& args, const std::string& function_name = "",
                           const Target& target = get_target_from_environment(),
                           LinkageType linkage = LinkageType::ExternalPlusMetadata) {
    return pipeline_to("compile ").module(args, function_name, target, linkage);
  }
  // Compiles to several files at once.
  void compile_to(const Files& output_files, const Args& args, const std::string& function_name,
                  const Target& target = get_target_from_environment()) {
    compile_to_module(args, function_name, target).compile(output_files);
  }
  // Writes an object file.
  void compile_to_object(const std::string& filename, const Args& args,
                         const std::string& function_name,
                         const Target& target = get_target_from_environment()) {
    compile_to({{OutputFileType::object, filename}}, args, function_name, target);
  }
  void compile_to_object(const std::string& filename, const Args& args,
                         const Target& target = get_target_from_environment()) {
    compile_to_object(filename, args, "", target);
  }
  // Writes LLVM bitcode.
  void compile_to_bitcode(const std::string& filename, const Args& args,
                          const std::string& function_name,
                          const Target& target = get_target_from_environment()) {
    compile_to({{OutputFileType::bitcode, filename}}, args, function_name, target);
  }
  void compile_to_bitcode(const std::string& filename, const Args& args,
                          const Target& target = get_target_from_environment()) {
    compile_to_bitcode(filename, args, "", target);
  }
  // Writes LLVM IR as text.
  void compile_to_llvm_assembly(const std::string& filename, const Args& args,
                                const std::string& function_name,
                                const Target& target = get_target_from_environment()) {
    compile_to({{OutputFileType::llvm_assembly, filename}}, args, function_name, target);
  }
  void compile_to_llvm_assembly(const std::string& filename, const Args& args,
                                const Target& target = get_target_from_environment()) {
    compile_to_llvm_assembly(filename, args, "", target);
  }
  // Writes assembly for the target.
  void compile_to_assembly(const std::string& filename, const Args& args,
                           const std::string& function_name,
                           const Target& target = get_target_from_environment()) {
    compile_to({{OutputFileType::assembly, filename}}, args, function_name, target);
  }
  void compile_to_assembly(const std::string& filename, const Args& args,
                           const Target& target = get_target_from_environment()) {
    compile_to_assembly(filename, args, "", target);
  }
  // Writes the C header that declares the function.
  void compile_to_header(const std::string& filename, const Args& args,
                         const std::string& function_name = "",
                         const Target& target = get_target_from_environment()) {
    compile_to({{OutputFileType::c_header, filename}}, args, function_name, target);
  }
  // Always throws Unsupported: there is no C output.
  void compile_to_c(const std::string& filename, const Args& args,
                    const std::string& function_name = "",
                    const Target& target = get_target_from_environment()) {  // Unsupported
    compile_to({{OutputFileType::c_source, filename}}, args, function_name, target);
  }
  // Writes the lowered loops as text, or as an HTML page with schedule, loops and machine code side by side.
  void compile_to_lowered_stmt(const std::string& filename, const Args& args,
                               StmtOutputFormat format = Text,
                               const Target& target = get_target_from_environment()) {
    const OutputFileType type = format == HTML ? OutputFileType::stmt_html : OutputFileType::stmt;
    compile_to({{type, filename}}, args, "", target);
  }
  // Writes prefix.o, with the runtime unless the target has no_runtime, and prefix.h.
  void compile_to_file(const std::string& filename_prefix, const Args& args,
                       const std::string& function_name = "",
                       const Target& target = get_target_from_environment()) {
    compile_to(frontend::file_and_header(OutputFileType::object, filename_prefix, target), args,
               function_name, target);
  }
  // Writes prefix.a, with the runtime unless the target has no_runtime, and prefix.h.
  void compile_to_static_library(const std::string& filename_prefix, const Args& args,
                                 const std::string& function_name = "",
                                 const Target& target = get_target_from_environment()) {
    compile_to(frontend::file_and_header(OutputFileType::static_library, filename_prefix, target),
               args, function_name, target);
  }
  // Writes a static library for several targets; at run time the first supported one is called. See
  // compile_multitarget.
  void compile_to_multitarget_static_library(const std::string& filename_prefix, const Args& args,
                                             const std::vector<Target>& targets) {
    frontend::compile_multitarget(OutputFileType::static_library, filename_prefix, targets, {},
                                  modules_of(args));
  }
  // Writes object files for several targets, one for each and one that selects; see compile_multitarget.
  void compile_to_multitarget_object_files(const std::string& filename_prefix, const Args& args,
                                           const std::vector<Target>& targets,
                                           const std::vector<std::string>& suffixes) {
    frontend::compile_multitarget(OutputFileType::object, filename_prefix, targets, suffixes,
                                  modules_of(args));
  }

 private:
  // This object as a Pipeline. If it cannot be one, the message names it and says `asked`.
  auto& pipeline_to(const char* asked) { return static_cast<Self&>(*this).pipeline_to(asked); }
  JITHandlers& handlers() { return static_cast<Self&>(*this).jit_handlers(); }
  auto modules_of(const Args& args) {
    return [this, args](const std::string& name, const Target& target) {
      return compile_to_module(args, name, target);
    };
  }
};

}  // namespace retrograde

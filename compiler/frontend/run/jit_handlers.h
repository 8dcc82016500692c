// jit_handlers.h -- handlers that compiled code calls, and descriptions of C functions that it may call by name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <type_traits>
#include <utility>
#include <vector>

#include "ir/type.h"

struct halide_trace_event_t;

namespace retrograde {

struct JITUserContext;

// One iteration of a parallel loop. Returns 0 or an error code.
using JITTask = int (*)(JITUserContext*, int, uint8_t*);

// Functions that compiled code calls in place of the runtime's; null selects the runtime's own. All except
// the error handler may run on several threads at once. They receive the context that was passed to
// realize(), or a default one.
struct JITHandlers {
  // Receives the text of print() and of traces; by default it goes to standard output.
  void (*custom_print)(JITUserContext*, const char*){nullptr};
  // Allocates memory for intermediate results; returns null if there is none. Set custom_free with it.
  void* (*custom_malloc)(JITUserContext*, size_t){nullptr};
  // Frees memory that custom_malloc returned.
  void (*custom_free)(JITUserContext*, void*){nullptr};
  // Runs one iteration of a parallel loop. It must return task(context, index, closure) with the context that
  // it received.
  int (*custom_do_task)(JITUserContext*, JITTask task, int index, uint8_t* closure){nullptr};
  // Runs a parallel loop: calls the task for every index in [min, min + extent).
  int (*custom_do_par_for)(JITUserContext*, JITTask task, int min, int extent,
                           uint8_t* closure){nullptr};
  // Receives the error of a call, including arguments that do not fit: Params beyond their limits, and
  // buffers of another type or shape. realize() then returns without throwing.
  void (*custom_error)(JITUserContext*, const char*){nullptr};
  // Receives every trace event and returns its number, by which other events name it as their parent.
  int32_t (*custom_trace)(JITUserContext*, const halide_trace_event_t*){nullptr};
  // Never called; present for programs written for Halide.
  void* (*custom_get_symbol)(const char* name){nullptr};
  // Never called; present for programs written for Halide.
  void* (*custom_load_library)(const char* name){nullptr};
  // Never called; present for programs written for Halide.
  void* (*custom_get_library_symbol)(void* library, const char* name){nullptr};
  // Provides the CUDA context of a call. By default it is the thread's current context, or the device's
  // primary one. A nonzero result ends the call.
  int32_t (*custom_cuda_acquire_context)(JITUserContext*, void** context, bool create){nullptr};
  // Releases the context that custom_cuda_acquire_context provided.
  int32_t (*custom_cuda_release_context)(JITUserContext*){nullptr};
  // Provides the CUDA stream of a call; by default it is the default stream.
  int32_t (*custom_cuda_get_stream)(JITUserContext*, void* context, void** stream){nullptr};

  // An addition to Halide's handlers: like custom_print, which takes precedence, but able to hold state.
  std::function<void(const char*)> print;
  int thread_limit = 0;  // maximum threads of parallel loops; 0: no limit
};

namespace frontend {
// Handlers for all calls of this process. Handlers of a Pipeline or of a call take precedence.
JITHandlers default_handlers();
JITHandlers set_default_handlers(const JITHandlers& handlers);  // returns the previous ones
}  // namespace frontend

// The context of a call, which handlers receive; derive from it to pass more data. Its handlers take
// precedence over those of the Pipeline.
struct JITUserContext {
  JITHandlers handlers;  // handlers of this call
};

// The types of a C function.
class ExternSignature {
 public:
  ExternSignature() = default;  // a function without a result and arguments, of unknown type
  ExternSignature(const Type& result, bool is_void, std::vector<Type> args)
      : result_(result), is_void_(is_void), args_(std::move(args)) {}
  // The signature of a function pointer.
  template <typename R, typename... Args>
  explicit ExternSignature(R (*)(Args...)) : is_void_(std::is_void_v<R>) {
    if constexpr (!std::is_void_v<R>) result_ = type_of<R>();
    args_ = {type_of<std::remove_cv_t<Args>>()...};
  }
  const Type& ret_type() const { return result_; }              // type of the result
  bool is_void_return() const { return is_void_; }              // whether there is no result
  const std::vector<Type>& arg_types() const { return args_; }  // types of the arguments

 private:
  Type result_;
  bool is_void_ = false;
  std::vector<Type> args_;
};

// A C function of this process, with its signature.
class ExternCFunction {
 public:
  ExternCFunction() = default;  // no function
  ExternCFunction(void* address, ExternSignature signature)
      : address_(address), signature_(std::move(signature)) {}
  // A function from its pointer, or from an address and a signature.
  template <typename R, typename... Args>
  ExternCFunction(R (*f)(Args...))
      : ExternCFunction(reinterpret_cast<void*>(f), ExternSignature(f)) {}
  void* address() const { return address_; }                       // address of the code
  const ExternSignature& signature() const { return signature_; }  // types of result and arguments

 private:
  void* address_ = nullptr;
  ExternSignature signature_;
};

}  // namespace retrograde

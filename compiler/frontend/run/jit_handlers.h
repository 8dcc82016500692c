// jit_handlers.h -- what compiled code may call back, and which C functions it may call.
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

// One iteration of a parallel loop. Gives 0 or an error code.
using JITTask = int (*)(JITUserContext*, int, uint8_t*);

// Functions that compiled code calls in place of the runtime's; null stands for the runtime's own.
// All but the error handler may be called from several threads at once. They get the context that
// realize() was given, or one of its own.
struct JITHandlers {
  // Text of print() and of traces; default: the standard output stream.
  void (*custom_print)(JITUserContext*, const char*){nullptr};
  // Memory of intermediate results; custom_malloc gives null when there is none. Set both.
  void* (*custom_malloc)(JITUserContext*, size_t){nullptr};
  void (*custom_free)(JITUserContext*, void*){nullptr};
  // Runs one iteration: return task(context, index, closure), with the context it was given.
  int (*custom_do_task)(JITUserContext*, JITTask task, int index, uint8_t* closure){nullptr};
  // Runs a loop: calls the task for every index of [min, min + extent).
  int (*custom_do_par_for)(JITUserContext*, JITTask task, int min, int extent,
                           uint8_t* closure){nullptr};
  // Told of the error of a call, also of arguments that do not fit: Params beyond their limits, and
  // buffers of another type or shape. realize() then returns and throws nothing.
  void (*custom_error)(JITUserContext*, const char*){nullptr};
  // Told of every event of a trace; gives its number, which other events name as their parent.
  int32_t (*custom_trace)(JITUserContext*, const halide_trace_event_t*){nullptr};
  // Of runtimes that load libraries themselves: nothing calls them.
  void* (*custom_get_symbol)(const char* name){nullptr};
  void* (*custom_load_library)(const char* name){nullptr};
  void* (*custom_get_library_symbol)(void* library, const char* name){nullptr};
  // The device's context and stream of a call; default: the thread's current context, or the device's primary
  // one, and its default stream. A code other than 0 ends the call.
  int32_t (*custom_cuda_acquire_context)(JITUserContext*, void** context, bool create){nullptr};
  int32_t (*custom_cuda_release_context)(JITUserContext*){nullptr};
  int32_t (*custom_cuda_get_stream)(JITUserContext*, void* context, void** stream){nullptr};

  // Beyond Halide's: as custom_print, which goes first, and with state of its own.
  std::function<void(const char*)> print;
  int thread_limit = 0;  // threads of parallel loops; 0: as many as there are
};

namespace frontend {
// Handlers of all calls of this process. Handlers of a Pipeline or of a call take precedence.
JITHandlers default_handlers();
JITHandlers set_default_handlers(const JITHandlers& handlers);  // the ones before come back
}  // namespace frontend

// What a call hands to the handlers: derive from it to carry more. Its handlers go before those of
// the Pipeline.
struct JITUserContext {
  JITHandlers handlers;
};

// The types of a C function.
class ExternSignature {
 public:
  ExternSignature() = default;
  ExternSignature(const Type& result, bool is_void, std::vector<Type> args)
      : result_(result), is_void_(is_void), args_(std::move(args)) {}
  template <typename R, typename... Args>
  explicit ExternSignature(R (*)(Args...)) : is_void_(std::is_void_v<R>) {
    if constexpr (!std::is_void_v<R>) result_ = type_of<R>();
    args_ = {type_of<std::remove_cv_t<Args>>()...};
  }
  const Type& ret_type() const { return result_; }
  bool is_void_return() const { return is_void_; }
  const std::vector<Type>& arg_types() const { return args_; }

 private:
  Type result_;
  bool is_void_ = false;
  std::vector<Type> args_;
};

// A C function of this process.
class ExternCFunction {
 public:
  ExternCFunction() = default;
  ExternCFunction(void* address, ExternSignature signature)
      : address_(address), signature_(std::move(signature)) {}
  template <typename R, typename... Args>
  ExternCFunction(R (*f)(Args...))
      : ExternCFunction(reinterpret_cast<void*>(f), ExternSignature(f)) {}
  void* address() const { return address_; }
  const ExternSignature& signature() const { return signature_; }

 private:
  void* address_ = nullptr;
  ExternSignature signature_;
};

}  // namespace retrograde

// call.cpp -- turns values of parameters into the argument vector of compiled code, and error codes into exceptions.
#include "frontend/run/call.h"

#include <atomic>
#include <cstdio>
#include <mutex>
#include <utility>

namespace retrograde::frontend {

uint64_t scalar_bits(const Scalar& value) {
  if (!value.type.is_float()) return value.u;
  return eval_reinterpret(UInt(value.type.bits()), value).u;
}

void check_limits(const ParameterContents& parameter, const Scalar& value,
                  const std::string& asked) {
  const auto limit = [&](const Expr& e) { return e.defined() ? as_scalar(e) : std::nullopt; };
  const auto minimum = limit(parameter.min_value), maximum = limit(parameter.max_value);
  const auto less = [](const Scalar& a, const Scalar& b) {
    return eval_binary(Kind::LT, a, b).as_bool();
  };
  const bool too_small = minimum && less(value, *minimum);
  const bool too_large = maximum && less(*maximum, value);
  if (!too_small && !too_large) return;
  call_error(
      asked, text("the Param ", quoted(parameter.name), " must keep its limits"),
      text("its value is ", value.as_double(), " and its ", too_small ? "minimum " : "maximum ",
           (too_small ? *minimum : *maximum).as_double()),
      "Set a value inside the limits");
}

void check_buffer(const halide_buffer_t* buffer, const std::string& name, Type type, int dimensions,
                  bool with_memory, const std::string& asked) {
  const auto what = [&] { return "the buffer for " + quoted(name); };  // built only for errors
  if (!buffer)
    call_error(asked, what() + " must not be null", "a null halide_buffer_t* was given",
               "Give a buffer");
  const Type actual = from_halide_type(buffer->type);
  if (actual != type) {
    call_error(asked, what() + " must have the right element type",
               text("it holds ", to_string(actual), ", ", to_string(type), " is needed"),
               "Give a buffer of that type");
  }
  if (buffer->dimensions != dimensions) {
    call_error(asked, what() + " must have the right number of dimensions",
               text("it has ", buffer->dimensions, ", ", dimensions, " are needed"),
               "Give a buffer of that many dimensions");
  }
  for (int d = 0; d < dimensions; d++) {
    if (buffer->dim[d].extent >= 0) continue;
    call_error(asked, what() + " must not have negative extents",
               text("dimension ", d, " has extent ", buffer->dim[d].extent),
               "Give extents of at least 0");
  }
  if (with_memory && !buffer->host && !buffer->device) {
    call_error(asked, what() + " must have memory", "it has only a shape",
               "Call allocate() on it first");
  }
}

Arguments::Arguments(const CompiledPipeline& code, std::vector<halide_buffer_t*> outputs,
                     bool is_query, std::string asked, const ParamMap& map)
    : asked_(std::move(asked)), map_(map), outputs_(std::move(outputs)) {
  scalars_.reserve(code.arguments().size());
  queries_.reserve(code.arguments().size());
  for (const LoweredArgument& arg : code.arguments()) argv_.push_back(bind(arg, is_query));
  RETROGRADE_ASSERT(next_output_ == outputs_.size(), "compiled code has another number of outputs");
}

void* Arguments::bind(const LoweredArgument& arg, bool is_query) {
  if (arg.kind == LoweredArgument::Kind::OutputBuffer) {
    RETROGRADE_ASSERT(next_output_ < outputs_.size(),
                      "compiled code has another number of outputs");
    return outputs_[next_output_++];
  }
  auto parameter = std::dynamic_pointer_cast<ParameterContents>(arg.symbol.lock());
  RETROGRADE_ASSERT(parameter != nullptr, "the argument ", quoted(arg.name),
                    " of compiled code stands for nothing");
  return arg.is_buffer() ? bind_buffer(parameter, is_query) : bind_scalar(parameter);
}

void* Arguments::bind_scalar(const ParameterPtr& parameter) {
  const ParamMap::Entry* entry = map_.find(parameter);
  const std::optional<Scalar>& value = entry ? entry->value : parameter->value;
  if (!value) {
    call_error(asked_, text("the Param ", quoted(parameter->name), " needs a value"),
               "none was set", "Call set() on it first");
  }
  check_limits(*parameter, *value, asked_);
  scalars_.push_back(scalar_bits(*value));
  return &scalars_.back();
}

void* Arguments::bind_buffer(const ParameterPtr& parameter, bool is_query) {
  const ParamMap::Entry* entry = map_.find(parameter);
  halide_buffer_t* bound = entry ? entry->raw_buffer() : parameter->buffer;
  if (bound) {
    check_buffer(bound, parameter->name, parameter->type, parameter->dimensions, true, asked_);
    return bound;
  }
  if (!is_query) {
    call_error(asked_, text("the ImageParam ", quoted(parameter->name), " needs a buffer"),
               "none was set", "Call set() on it first, or infer_input_bounds()");
  }
  std::vector<int> nothing(parameter->dimensions, 0);
  queries_.push_back(
      {parameter, Runtime::Buffer<>(to_halide_type(parameter->type), nullptr, nothing)});
  return queries_.back().buffer.raw_buffer();
}

JITHandlers merged(JITHandlers handlers, const JITHandlers& first) {
  const auto take = [](auto& to, const auto& from) {
    if (from) to = from;
  };
  take(handlers.custom_print, first.custom_print);
  take(handlers.custom_malloc, first.custom_malloc);
  take(handlers.custom_free, first.custom_free);
  take(handlers.custom_do_task, first.custom_do_task);
  take(handlers.custom_do_par_for, first.custom_do_par_for);
  take(handlers.custom_error, first.custom_error);
  take(handlers.custom_trace, first.custom_trace);
  take(handlers.custom_cuda_acquire_context, first.custom_cuda_acquire_context);
  take(handlers.custom_cuda_release_context, first.custom_cuda_release_context);
  take(handlers.custom_cuda_get_stream, first.custom_cuda_get_stream);
  take(handlers.print, first.print);
  if (first.thread_limit > 0) handlers.thread_limit = first.thread_limit;
  return handlers;
}

namespace {

// Prints to stdout, through the same buffer as the program's own output.
void default_print(const char* message) {
  std::fputs(message, stdout);
  std::fflush(stdout);
}

struct DefaultHandlers {
  std::mutex mutex;
  JITHandlers handlers;
  std::atomic<bool> are_set = false;
};
DefaultHandlers& defaults() {
  static DefaultHandlers result;
  return result;
}

// The handlers of a call. The caller's take precedence over the pipeline's, and these over the process's.
JITHandlers handlers_of(const JITHandlers& own, const JITUserContext* user) {
  JITHandlers handlers = defaults().are_set ? merged(default_handlers(), own) : own;
  return user ? merged(std::move(handlers), user->handlers) : handlers;
}

void check_handlers(const JITHandlers& handlers, const std::string& asked) {
  if (!handlers.custom_malloc != !handlers.custom_free) {
    user_error(asked, "custom_malloc and custom_free come together",
               handlers.custom_malloc ? "only custom_malloc is set" : "only custom_free is set",
               "Set both, or neither");
  }
}

}  // namespace

int prepared(const JITHandlers& own, JITUserContext* user, FunctionRef<void()> prepare) {
  try {
    prepare();
    return 0;
  } catch (const RuntimeError& error) {
    const auto custom = handlers_of(own, user).custom_error;
    if (!custom) throw;
    JITUserContext nobody;
    custom(user ? user : &nobody, error.what());
    return error.code() != 0 ? error.code() : halide_error_code_generic_error;
  }
}

JITHandlers default_handlers() {
  const std::lock_guard lock(defaults().mutex);
  return defaults().handlers;
}
JITHandlers set_default_handlers(const JITHandlers& handlers) {
  const std::lock_guard lock(defaults().mutex);
  defaults().are_set = true;
  return std::exchange(defaults().handlers, handlers);
}

int call(const CompiledPipeline& code, const JITHandlers& own, void* const* argv,
         const std::string& asked, JITUserContext* user) {
  JITUserContext nobody;
  CallContext context;
  context.handlers = handlers_of(own, user);
  context.user_context = user ? user : &nobody;
  check_handlers(context.handlers, asked);
  context.print = context.handlers.print ? context.handlers.print : default_print;
  if (const auto custom = context.handlers.custom_print) {
    context.print = [custom, to = context.user_context](const char* text) { custom(to, text); };
  }
  context.thread_limit = context.handlers.thread_limit;
  const int code_returned = code.run(argv, context);
  if (code_returned == 0) return 0;
  if (const auto custom = context.handlers.custom_error) {
    const std::string unnamed = text("cannot ", asked, ": error code ", code_returned);
    custom(context.user_context, context.error.empty() ? unnamed.c_str() : context.error.c_str());
    return code_returned;
  }
  if (!context.error.empty()) throw RuntimeError(context.error, code_returned);
  call_error(
      asked, "the compiled code must succeed", text("it returned the error code ", code_returned),
      "Look the code up in HalideRuntime.h; a handler of errors gets its text", code_returned);
}

}  // namespace retrograde::frontend

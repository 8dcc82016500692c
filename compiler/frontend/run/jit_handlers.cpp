// jit_handlers.cpp -- setting handlers one by one, as Halide's older interface does, and C
// functions by name.
#include "frontend/run/jit_handlers.h"

#include "diagnostics/error.h"
#include "frontend/language/extern_function.h"
#include "frontend/language/func.h"
#include "ir/build.h"

namespace retrograde {

namespace {

// Handlers of that interface take the context as a void*: the same call.
template <typename To, typename From>
To with_context(From* handler) {
  return reinterpret_cast<To>(handler);
}

}  // namespace

void Pipeline::set_error_handler(void (*handler)(void*, const char*)) {
  jit_handlers().custom_error = with_context<decltype(JITHandlers::custom_error)>(handler);
}

void Pipeline::set_custom_allocator(void* (*malloc)(void*, size_t), void (*free)(void*, void*)) {
  if (!malloc != !free) {
    user_error("set a custom allocator", "allocation and release come together",
               malloc ? "no function to free was given" : "no function to allocate was given",
               "Give both, or neither");
  }
  jit_handlers().custom_malloc = with_context<decltype(JITHandlers::custom_malloc)>(malloc);
  jit_handlers().custom_free = with_context<decltype(JITHandlers::custom_free)>(free);
}

void Pipeline::set_custom_do_task(int (*handler)(void*, int (*)(void*, int, uint8_t*), int,
                                                 uint8_t*)) {
  jit_handlers().custom_do_task = with_context<decltype(JITHandlers::custom_do_task)>(handler);
}

void Pipeline::set_custom_do_par_for(int (*handler)(void*, int (*)(void*, int, uint8_t*), int, int,
                                                    uint8_t*)) {
  jit_handlers().custom_do_par_for =
      with_context<decltype(JITHandlers::custom_do_par_for)>(handler);
}

void Pipeline::set_custom_trace(int (*handler)(void*, const halide_trace_event_t*)) {
  jit_handlers().custom_trace = with_context<decltype(JITHandlers::custom_trace)>(handler);
}

void Pipeline::set_custom_print(void (*handler)(void*, const char*)) {
  jit_handlers().custom_print = with_context<decltype(JITHandlers::custom_print)>(handler);
}

static Pipeline supported_extern(Pipeline pipeline) {
  unsupported("call a Pipeline by name", "what a pipeline calls by name is a C function",
              "the JITExtern is made from a Pipeline",
              "Use the Func itself, or a C function that calls realize()");
  return pipeline;
}

JITExtern::JITExtern(Pipeline pipeline) : pipeline_(supported_extern(std::move(pipeline))) {}
JITExtern::JITExtern(const Func& func) : JITExtern(Pipeline(func)) {}

Expr ir::checked_extern_call(const std::string& function, Type result,
                             const std::vector<Type>& types, const std::vector<Expr>& args) {
  const std::string asked = "call the C function " + quoted(function);
  for (size_t i = 0; i < args.size(); i++) {
    if (!args[i].defined())
      user_error(asked, "every argument is a defined expression", "one was never assigned",
                 "Assign every Expr before it is used");
    if (args[i].type() == types[i]) continue;
    user_error(asked, "its arguments have the types that it was declared with",
               text("argument ", i + 1, " is of type ", to_string(args[i].type()), ", not ",
                    to_string(types[i])),
               "Cast it");
  }
  return call_extern(function, result, args);
}

// ---- the same of a Func ----

void Func::set_error_handler(void (*handler)(void*, const char*)) {
  pipeline().set_error_handler(handler);
}
void Func::set_custom_allocator(void* (*malloc)(void*, size_t), void (*free)(void*, void*)) {
  pipeline().set_custom_allocator(malloc, free);
}
void Func::set_custom_do_task(int (*handler)(void*, int (*)(void*, int, uint8_t*), int, uint8_t*)) {
  pipeline().set_custom_do_task(handler);
}
void Func::set_custom_do_par_for(int (*handler)(void*, int (*)(void*, int, uint8_t*), int, int,
                                                uint8_t*)) {
  pipeline().set_custom_do_par_for(handler);
}
void Func::set_custom_trace(int (*handler)(void*, const halide_trace_event_t*)) {
  pipeline().set_custom_trace(handler);
}
void Func::set_custom_print(void (*handler)(void*, const char*)) {
  pipeline().set_custom_print(handler);
}
void Func::set_jit_externs(const std::map<std::string, JITExtern>& externs) {
  pipeline().set_jit_externs(externs);
}
const std::map<std::string, JITExtern>& Func::get_jit_externs() {
  return pipeline().get_jit_externs();
}

}  // namespace retrograde

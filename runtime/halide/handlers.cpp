// Printing, errors and memory by HalideRuntime.h: a handler that the program sets, or the default.
//
// Without a handler, an error ends the process, as in Halide: a program that ignores error codes must not continue with
// results that were never computed. With a handler, functions return the code. Unlike Halide's default, memory comes
// from the pool of memory.cpp.
#include "halide/handlers.h"

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <cstring>

#include "halide/weak.h"

namespace {

std::atomic<halide_print_t> print_handler{halide_default_print};
std::atomic<halide_error_handler_t> error_handler{halide_default_error};
std::atomic<halide_malloc_t> malloc_handler{halide_default_malloc};
std::atomic<halide_free_t> free_handler{halide_default_free};

// The handler before; null stands for the default.
template <typename Handler>
Handler exchange(std::atomic<Handler>& current, Handler wanted, Handler fallback) {
  return current.exchange(wanted ? wanted : fallback);
}

void tell_error(retrograde_context* context, int, const char* message) {
  halide_error(context->user_data, message);
}

void print(retrograde_context* context, const char* text) {
  halide_print(context->user_data, text);
}

}  // namespace

retrograde_context retrograde::runtime::reporting_context(void* user_context) {
  retrograde_context context = {};
  context.error_handler = tell_error;
  context.print_handler = print;
  context.user_data = user_context;
  return context;
}

RETROGRADE_WEAK void halide_default_print(void*, const char* text) {
  size_t length = std::strlen(text);
  while (length > 0) {
    const ssize_t written = write(STDERR_FILENO, text, length);
    if (written <= 0) return;
    text += written;
    length -= static_cast<size_t>(written);
  }
}
RETROGRADE_WEAK void halide_print(void* user_context, const char* text) {
  print_handler.load()(user_context, text);
}
RETROGRADE_WEAK halide_print_t halide_set_custom_print(halide_print_t print) {
  return exchange(print_handler, print, halide_default_print);
}

RETROGRADE_WEAK void halide_default_error(void* user_context, const char* message) {
  char line[4096];
  retrograde_format_message(line, sizeof line, "Error: %s\n", message);
  halide_print(user_context, line);
  std::abort();
}
RETROGRADE_WEAK void halide_error(void* user_context, const char* message) {
  error_handler.load()(user_context, message);
}
RETROGRADE_WEAK halide_error_handler_t halide_set_error_handler(halide_error_handler_t handler) {
  return exchange(error_handler, handler, halide_default_error);
}

RETROGRADE_WEAK void* halide_default_malloc(void*, size_t bytes) {
  return retrograde_pool_malloc(bytes);
}
RETROGRADE_WEAK void halide_default_free(void*, void* block) { retrograde_pool_free(block); }
RETROGRADE_WEAK void* halide_malloc(void* user_context, size_t bytes) {
  return malloc_handler.load()(user_context, bytes);
}
RETROGRADE_WEAK void halide_free(void* user_context, void* block) {
  free_handler.load()(user_context, block);
}
RETROGRADE_WEAK halide_malloc_t halide_set_custom_malloc(halide_malloc_t handler) {
  return exchange(malloc_handler, handler, halide_default_malloc);
}
RETROGRADE_WEAK halide_free_t halide_set_custom_free(halide_free_t handler) {
  return exchange(free_handler, handler, halide_default_free);
}

// Handlers of JIT-compiled pipelines: printing, errors, memory, parallel loops, and the context
// that they receive.
#include "Halide.h"

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

using namespace Halide;

static std::string printed, error_text;
static std::atomic<int> allocations{0}, releases{0}, tasks{0};

void keep_print(JITUserContext*, const char* message) { printed += message; }
void keep_error(JITUserContext*, const char* message) { error_text = message; }
void* count_malloc(JITUserContext*, size_t bytes) {
  allocations++;
  void* block = nullptr;
  return posix_memalign(&block, 128, bytes + 128) ? nullptr : block;
}
void count_free(JITUserContext*, void* block) {
  if (block) releases++;
  free(block);
}
int backwards(JITUserContext* context, int (*task)(JITUserContext*, int, uint8_t*), int min,
              int extent, uint8_t* closure) {
  for (int i = min + extent - 1; i >= min; i--) {
    tasks++;
    int code = task(context, i, closure);
    if (code) return code;
  }
  return 0;
}

int main() {
  Var x("x"), y("y");
  {
    Func f("f");
    f(x) = print(x * 3, "at", x);
    f.jit_handlers().custom_print = keep_print;
    f.realize({3});
    printf("caught: %s", printed.c_str());
  }
  {
    Func table("table"), f("f");
    table(x, y) = x * y;
    f(x, y) = table(x, y) + table(x + 1, y + 1);
    table.compute_root();
    f.jit_handlers().custom_malloc = count_malloc;
    f.jit_handlers().custom_free = count_free;
    Buffer<int> out = f.realize({100, 80});
    printf("%d, allocations %d, releases %d\n", out(99, 79), (int)allocations, (int)releases);
  }
  {
    Func f("f");
    f(x, y) = x + y;
    f.parallel(y);
    f.jit_handlers().custom_do_par_for = backwards;
    Buffer<int> out = f.realize({10, 7});
    printf("%d, tasks %d\n", out(9, 6), (int)tasks);
  }
  {
    // An error handler receives errors; nothing is thrown.
    ImageParam input(Int(32), 1, "input");
    Func f("f");
    f(x) = input(x + 5);
    f.jit_handlers().custom_error = keep_error;
    Buffer<int> small(10);
    small.fill(1);
    input.set(small);
    f.realize({20});
    printf("the error names the input: %d\n", (int)(error_text.find("input") != std::string::npos));
  }
  {
    // Without an error handler, errors are exceptions.
    Param<int> divisor("divisor");
    divisor.set_range(1, 10);
    divisor.set(11);
    Func f("f");
    f(x) = x / divisor;
    try {
      f.realize({4});
      printf("nothing thrown\n");
    } catch (const RuntimeError& e) {
      printf("thrown, and it names the Param: %d\n", (int)(strstr(e.what(), "divisor") != nullptr));
    }
    printf("exceptions: %d\n", (int)exceptions_enabled());
  }
  {
    // Errors in a definition are found before anything runs.
    Func f("f");
    Var z("z");
    try {
      f(x) = x + z;
      printf("nothing thrown\n");
    } catch (const CompileError& e) {
      printf("refused, and it names the Var: %d\n", (int)(strstr(e.what(), "z") != nullptr));
    } catch (const Error&) {
      printf("another error\n");
    }
  }
  return 0;
}

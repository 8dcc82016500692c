// Parallel loops and threads by HalideRuntime.h.
#include <pthread.h>

#include <atomic>
#include <new>

#include "halide/weak.h"
#include "parallel.h"
#include "report.h"
#include "spare_threads.h"
#include "thread_pool.h"

namespace {

std::atomic<halide_do_par_for_t> par_for_handler{halide_default_do_par_for};
std::atomic<halide_do_task_t> task_handler{halide_default_do_task};

struct Loop {
  void* user_context;
  halide_task_t task;
  uint8_t* closure;
};

int32_t run_iteration(void* data, int32_t index) {
  const Loop& loop = *static_cast<Loop*>(data);
  return halide_do_task(loop.user_context, loop.task, index, loop.closure);
}

void tell_error(void* data, int32_t, const char* message) {
  if (retrograde::runtime::keep_for_loop(message)) return;
  halide_error(static_cast<Loop*>(data)->user_context, message);
}

// Runs when the process exits, or when the library that holds this code is unloaded.
__attribute__((destructor)) void end_threads() { halide_shutdown_thread_pool(); }

}  // namespace

RETROGRADE_WEAK int halide_default_do_task(void* user_context, halide_task_t task, int index,
                                           uint8_t* closure) {
  return task(user_context, index, closure);
}
RETROGRADE_WEAK int halide_do_task(void* user_context, halide_task_t task, int index,
                                   uint8_t* closure) {
  return task_handler.load(std::memory_order_relaxed)(user_context, task, index, closure);
}
RETROGRADE_WEAK halide_do_task_t halide_set_custom_do_task(halide_do_task_t handler) {
  return task_handler.exchange(handler ? handler : halide_default_do_task);
}

RETROGRADE_WEAK int halide_default_do_par_for(void* user_context, halide_task_t task, int min,
                                              int size, uint8_t* closure) {
  Loop loop{user_context, task, closure};
  return retrograde::runtime::run_parallel_loop({min, size, 0, &loop, run_iteration, tell_error});
}
RETROGRADE_WEAK int halide_do_par_for(void* user_context, halide_task_t task, int min, int size,
                                      uint8_t* closure) {
  return par_for_handler.load()(user_context, task, min, size, closure);
}
RETROGRADE_WEAK halide_do_par_for_t halide_set_custom_do_par_for(halide_do_par_for_t handler) {
  return par_for_handler.exchange(handler ? handler : halide_default_do_par_for);
}

// Only later Halide releases declare these.
RETROGRADE_WEAK int halide_get_num_threads() { return retrograde::runtime::thread_count(); }
RETROGRADE_WEAK int halide_set_num_threads(int count) {
  if (count < 0) {
    halide_error(nullptr,
                 "cannot set the number of threads: it must not be negative. Give 0 for as many as "
                 "the machine has");
    return halide_error_code_generic_error;
  }
  return retrograde::runtime::set_thread_count(count);
}
RETROGRADE_WEAK void halide_shutdown_thread_pool() {
  retrograde::runtime::shut_down_threads();
  retrograde::runtime::end_spare_threads();
}

struct halide_thread {
  pthread_t handle;
  void (*function)(void*);
  void* closure;
};

static void* run_thread(void* data) {
  const auto* thread = static_cast<halide_thread*>(data);
  thread->function(thread->closure);
  return nullptr;
}

RETROGRADE_WEAK halide_thread* halide_spawn_thread(void (*function)(void*), void* closure) {
  auto* thread = new (std::nothrow) halide_thread{{}, function, closure};
  if (thread && pthread_create(&thread->handle, nullptr, run_thread, thread) != 0) {
    delete thread;
    return nullptr;
  }
  return thread;
}
RETROGRADE_WEAK void halide_join_thread(halide_thread* thread) {
  pthread_join(thread->handle, nullptr);
  delete thread;
}

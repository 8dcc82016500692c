// Tasks that run in parallel and wait for each other, by HalideRuntime.h.
//
// Each task has a thread of its own, like the branches of a fork. So waiting tasks never block those that they wait
// for, whatever `min_threads` says. A task with semaphores acquires them before each iteration and runs its iterations
// in order. Without semaphores, its iterations are a parallel loop, or one call if the task is serial. If a task fails,
// waits for semaphores end.
#include <atomic>
#include <new>
#include <vector>

#include "halide/semaphores.h"
#include "halide/weak.h"
#include "parallel.h"
#include "report.h"
#include "spare_threads.h"

namespace {

namespace rt = retrograde::runtime;

std::atomic<halide_do_loop_task_t> loop_task_handler{halide_default_do_loop_task};
std::atomic<halide_do_parallel_tasks_t> tasks_handler{halide_default_do_parallel_tasks};

struct TaskRun {
  void* user_context;
  const halide_parallel_task_t* task;
  void* parent;
  std::atomic<bool>* any_failed;
  int code = 0;
  rt::SpareThread* thread = nullptr;

  int call(int min, int extent) const {
    return halide_do_loop_task(user_context, task->fn, min, extent, task->closure, parent);
  }

  bool acquire(const halide_semaphore_acquire_t& wanted) const {
    for (;;) {
      const uint32_t seen = rt::wake_count();
      if (any_failed->load()) return false;
      if (halide_semaphore_try_acquire(wanted.semaphore, wanted.count)) return true;
      rt::wait_for_wake(seen);
    }
  }
  bool acquire_all() const {
    for (int i = 0; i < task->num_semaphores; i++) {
      if (!acquire(task->semaphores[i])) return false;
    }
    return true;
  }

  int run_in_order() const {
    int result = 0;
    for (int i = 0; i < task->extent && result == 0; i++) {
      if (!acquire_all()) break;
      result = call(task->min + i, 1);
    }
    return result;
  }

  int run_in_parallel() {
    const auto iteration = [](void* run, int32_t index) {
      return static_cast<TaskRun*>(run)->call(index, 1);
    };
    const auto tell = [](void* run, int32_t, const char* message) {
      if (!rt::keep_for_loop(message))
        halide_error(static_cast<TaskRun*>(run)->user_context, message);
    };
    return rt::run_parallel_loop({task->min, task->extent, 0, this, iteration, tell});
  }

  void run() {
    if (task->extent <= 0) return;
    if (task->num_semaphores > 0) {
      code = run_in_order();
    } else {
      code = task->serial ? call(task->min, task->extent) : run_in_parallel();
    }
    if (code != 0) fail(code);
  }
  void fail(int with) {
    code = with;
    any_failed->store(true);
    rt::wake_waiting_tasks();
  }
};

void start(TaskRun& run) {
  run.thread =
      rt::begin_on_spare_thread([](void* data) { static_cast<TaskRun*>(data)->run(); }, &run);
  if (run.thread) return;
  halide_error(run.user_context, "cannot run tasks in parallel: the system has no thread left");
  run.fail(halide_error_code_out_of_memory);
}

}  // namespace

RETROGRADE_WEAK int halide_default_do_loop_task(void* user_context, halide_loop_task_t task,
                                                int min, int extent, uint8_t* closure,
                                                void* task_parent) {
  return task(user_context, min, extent, closure, task_parent);
}
RETROGRADE_WEAK int halide_do_loop_task(void* user_context, halide_loop_task_t task, int min,
                                        int extent, uint8_t* closure, void* task_parent) {
  return loop_task_handler.load()(user_context, task, min, extent, closure, task_parent);
}
RETROGRADE_WEAK halide_do_loop_task_t
halide_set_custom_do_loop_task(halide_do_loop_task_t handler) {
  return loop_task_handler.exchange(handler ? handler : halide_default_do_loop_task);
}

RETROGRADE_WEAK int halide_default_do_parallel_tasks(void* user_context, int num_tasks,
                                                     halide_parallel_task_t* tasks,
                                                     void* task_parent) {
  std::atomic<bool> any_failed{false};
  std::vector<TaskRun> runs;
  try {
    for (int i = 0; i < num_tasks; i++)
      runs.push_back({user_context, &tasks[i], task_parent, &any_failed});
  } catch (const std::bad_alloc&) {
    halide_error(user_context, "cannot run tasks in parallel: out of memory");
    return halide_error_code_out_of_memory;
  }
  for (size_t i = 1; i < runs.size(); i++) start(runs[i]);
  if (!runs.empty()) runs[0].run();
  int code = 0;
  for (TaskRun& run : runs) {
    if (run.thread) rt::finish_on(run.thread);
    if (code == 0) code = run.code;
  }
  return code;
}
RETROGRADE_WEAK int halide_do_parallel_tasks(void* user_context, int num_tasks,
                                             halide_parallel_task_t* tasks, void* task_parent) {
  return tasks_handler.load()(user_context, num_tasks, tasks, task_parent);
}

// Null restores the default.
RETROGRADE_WEAK void halide_set_custom_parallel_runtime(
    halide_do_par_for_t par_for, halide_do_task_t task, halide_do_loop_task_t loop_task,
    halide_do_parallel_tasks_t tasks, halide_semaphore_init_t semaphore_init,
    halide_semaphore_try_acquire_t try_acquire, halide_semaphore_release_t release) {
  halide_set_custom_do_par_for(par_for);
  halide_set_custom_do_task(task);
  halide_set_custom_do_loop_task(loop_task);
  tasks_handler = tasks ? tasks : halide_default_do_parallel_tasks;
  rt::set_semaphore_handlers(semaphore_init, try_acquire, release);
}

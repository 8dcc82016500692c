// Runs two statements in parallel, and provides the semaphores between them.
//
// The first runs on a thread of its own, the rest on the caller's thread. A thread of the parallel loops' pool would do
// as long as one is free. But the two may wait for each other many times, and a pool whose threads all wait can run no
// loops. With a thread for each statement, one of them can always make progress.
//
// A statement that fails closes the semaphores, so the other one finds out at its next wait and exits too. The call
// returns the error of the statement that failed by itself.
#include <atomic>
#include <new>

#include "report.h"
#include "spare_threads.h"

namespace retrograde::runtime {
namespace {

constexpr int32_t closed = INT32_MIN;
// Result of waiting for a closed semaphore. It is never reported; the original error replaces it.
constexpr int32_t cancelled = -1000;

using Count = std::atomic<int32_t>;
static_assert(sizeof(Count) <= retrograde_semaphore_bytes);

Count& count_of(void* semaphore) { return *static_cast<Count*>(semaphore); }

void close(void* semaphore) {
  count_of(semaphore).store(closed, std::memory_order_release);
  count_of(semaphore).notify_all();
}

struct Branch {
  retrograde_context* context;
  retrograde_task task;
  uint8_t* closure;
  void** semaphores;
  int32_t semaphore_count;
  int32_t code = 0;
  Failure failure = {};

  void run() {
    const FailureScope scope(&failure);
    code = task(context, 0, closure);
    for (int32_t i = 0; code != 0 && i < semaphore_count; i++) close(semaphores[i]);
  }
};

int32_t outcome(retrograde_context* context, const Branch& first, const Branch& rest) {
  const bool take_rest = first.code == 0 || (first.code == cancelled && rest.code != 0);
  const Branch& failed = take_rest ? rest : first;
  if (failed.code != 0 && failed.failure.message[0])
    report(context, failed.code, failed.failure.message);
  return failed.code;
}

}  // namespace
}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

int32_t retrograde_semaphore_init(retrograde_context*, void* semaphore, int32_t count) {
  new (semaphore) rt::Count(count);
  return 0;
}

int32_t retrograde_semaphore_release(retrograde_context*, void* semaphore, int32_t count) {
  rt::Count& has = rt::count_of(semaphore);
  int32_t now = has.load(std::memory_order_relaxed);
  do {
    if (now == rt::closed) return 0;
  } while (!has.compare_exchange_weak(now, now + count, std::memory_order_acq_rel));
  has.notify_all();
  return 0;
}

int32_t retrograde_semaphore_acquire(retrograde_context*, void* semaphore, int32_t count) {
  rt::Count& has = rt::count_of(semaphore);
  int32_t now = has.load(std::memory_order_acquire);
  while (now != rt::closed) {
    if (now < count) {
      has.wait(now, std::memory_order_acquire);
      now = has.load(std::memory_order_acquire);
    } else if (has.compare_exchange_weak(now, now - count, std::memory_order_acq_rel)) {
      return 0;
    }
  }
  return rt::cancelled;
}

int32_t retrograde_fork(retrograde_context* context, retrograde_task first, uint8_t* first_closure,
                        retrograde_task rest, uint8_t* rest_closure, void** semaphores,
                        int32_t semaphore_count) {
  rt::Branch a{context, first, first_closure, semaphores, semaphore_count};
  rt::Branch b{context, rest, rest_closure, semaphores, semaphore_count};
  rt::SpareThread* const thread =
      rt::begin_on_spare_thread([](void* branch) { static_cast<rt::Branch*>(branch)->run(); }, &a);
  if (!thread) {
    return retrograde_report_error(context, retrograde_error_out_of_memory,
                                   "cannot run an async producer: the system has no thread left");
  }
  b.run();
  rt::finish_on(thread);
  return rt::outcome(context, a, b);
}

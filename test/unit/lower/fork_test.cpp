// Forks and semaphores of the runtime without the compiler: who waits for whom, which error is
// reported, and which threads exist according to the kernel.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <iterator>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "retrograde_runtime.h"
#include "spare_threads.h"

namespace retrograde {
namespace {

struct Handshake {
  uint64_t ready = 0, space = 0;
  int rounds = 0, value = 0, sum = 0;
  int fail_at = -1;
};

int32_t produce(retrograde_context* context, int32_t, uint8_t* closure) {
  auto& h = *reinterpret_cast<Handshake*>(closure);
  for (int i = 0; i < h.rounds; i++) {
    if (int32_t code = retrograde_semaphore_acquire(context, &h.space, 1)) return code;
    if (i == h.fail_at) return retrograde_report_error(context, -27, "broken at %i", int64_t{i});
    h.value = i;
    retrograde_semaphore_release(context, &h.ready, 1);
  }
  return 0;
}

int32_t consume(retrograde_context* context, int32_t, uint8_t* closure) {
  auto& h = *reinterpret_cast<Handshake*>(closure);
  for (int i = 0; i < h.rounds; i++) {
    if (int32_t code = retrograde_semaphore_acquire(context, &h.ready, 1)) return code;
    h.sum += h.value;
    retrograde_semaphore_release(context, &h.space, 1);
  }
  return 0;
}

int32_t run(retrograde_context* context, Handshake& h) {
  retrograde_semaphore_init(context, &h.ready, 0);
  retrograde_semaphore_init(context, &h.space, 1);
  void* semaphores[] = {&h.ready, &h.space};
  auto* closure = reinterpret_cast<uint8_t*>(&h);
  return retrograde_fork(context, produce, closure, consume, closure, semaphores, 2);
}

TEST(Fork, SemaphoresOrderWhatTheBranchesWrite) {
  Handshake h;
  h.rounds = 20000;
  EXPECT_EQ(run(nullptr, h), 0);
  EXPECT_EQ(h.sum, 20000 / 2 * 19999);
}

TEST(Fork, TheErrorThatIsToldIsTheOneBehindTheOthers) {
  std::string told;
  retrograde_context context = {};
  context.user_data = &told;
  context.error_handler = [](retrograde_context* c, int, const char* message) {
    *static_cast<std::string*>(c->user_data) += message;
  };
  Handshake h;
  h.rounds = 100;
  h.fail_at = 57;
  EXPECT_EQ(run(&context, h), -27);
  EXPECT_EQ(told, "broken at 57");
}

// ---- threads ----

int32_t note_thread(retrograde_context*, int32_t, uint8_t* closure) {
  reinterpret_cast<std::set<pid_t>*>(closure)->insert(gettid());
  return 0;
}
int32_t do_nothing(retrograde_context*, int32_t, uint8_t*) { return 0; }

TEST(Fork, OneAfterTheOtherUsesOneThread) {
  std::set<pid_t> threads;
  auto* closure = reinterpret_cast<uint8_t*>(&threads);
  for (int i = 0; i < 2000; i++)
    ASSERT_EQ(retrograde_fork(nullptr, note_thread, closure, do_nothing, closure, nullptr, 0), 0);
  EXPECT_EQ(threads.size(), 1u);
  EXPECT_EQ(threads.count(gettid()), 0u);
}

// Forks inside both branches; every outer level waits for the innermost.
struct Nest {
  uint64_t bottom = 0;
  int depth = 0;
  std::atomic<int> done{0};
};
struct Level {
  Nest* nest;
  int depth;
};

int32_t wait_for_bottom(retrograde_context* context, int32_t, uint8_t* closure) {
  Nest& nest = *reinterpret_cast<Level*>(closure)->nest;
  if (int32_t code = retrograde_semaphore_acquire(context, &nest.bottom, 1)) return code;
  nest.done++;
  return retrograde_semaphore_release(context, &nest.bottom, 1);
}

int32_t go_down(retrograde_context* context, int32_t, uint8_t* closure) {
  const Level& here = *reinterpret_cast<Level*>(closure);
  if (here.depth == 0) return retrograde_semaphore_release(context, &here.nest->bottom, 1);
  Level below{here.nest, here.depth - 1};
  void* semaphores[] = {&here.nest->bottom};
  auto* next = reinterpret_cast<uint8_t*>(&below);
  // The outer level is on the borrowed thread at every other level.
  return here.depth % 2 == 0
             ? retrograde_fork(context, wait_for_bottom, next, go_down, next, semaphores, 1)
             : retrograde_fork(context, go_down, next, wait_for_bottom, next, semaphores, 1);
}

int32_t run_nest(Nest& nest) {
  retrograde_semaphore_init(nullptr, &nest.bottom, 0);
  Level top{&nest, nest.depth};
  return go_down(nullptr, 0, reinterpret_cast<uint8_t*>(&top));
}

TEST(Fork, NestsDeeperThanThreadsAreKept) {
  for (int round = 0; round < 3; round++) {
    Nest nest;
    nest.depth = 50;
    ASSERT_EQ(run_nest(nest), 0);
    ASSERT_EQ(nest.done, 50);
  }
}

TEST(Fork, RunsFromManyThreadsAtOnce) {
  std::vector<std::thread> callers;
  std::atomic<int> wrong{0};
  for (int t = 0; t < 6; t++) {
    callers.emplace_back([&wrong] {
      for (int i = 0; i < 100; i++) {
        Nest nest;
        nest.depth = 4;
        wrong += run_nest(nest) != 0 || nest.done != 4;
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(wrong, 0);
}

int64_t threads_of_this_process() {
  using Folder = std::filesystem::directory_iterator;
  return std::distance(Folder("/proc/self/task"), Folder());
}

TEST(Fork, ThreadsThatAreKeptAreFewAndEndWhenAsked) {
  runtime::end_spare_threads();
  const int64_t before = threads_of_this_process();
  Nest nest;
  nest.depth = 50;
  ASSERT_EQ(run_nest(nest), 0);
  const int64_t kept = threads_of_this_process() - before;
  EXPECT_GE(kept, 1);
  EXPECT_LE(kept, 16);
  runtime::end_spare_threads();
  // The kernel lists a joined thread for a short time after it ended.
  for (int i = 0; i < 5000 && threads_of_this_process() > before; i++) usleep(1000);
  EXPECT_EQ(threads_of_this_process(), before);
  Handshake h;
  h.rounds = 3;
  EXPECT_EQ(run(nullptr, h), 0);
}

// The race detector does not support threads in such a process.
#ifndef __SANITIZE_THREAD__
TEST(Fork, RunsInAChildProcessThatHasNoneOfTheThreads) {
  Handshake h;
  h.rounds = 5;
  ASSERT_EQ(run(nullptr, h), 0);
  const pid_t child = fork();
  if (child == 0) {
    alarm(20);
    Handshake again;
    again.rounds = 5;
    _exit(run(nullptr, again) == 0 && again.sum == 10 ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}
#endif

}  // namespace
}  // namespace retrograde

// Target::Profile: the table of times, threads and memory by Func.
#include <HalideRuntime.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "frontend/include/retrograde/retrograde.h"
#include "retrograde_runtime.h"
#include "support/errors.h"

extern "C" __attribute__((visibility("default"))) int profiler_test_sleep(int value) {
  std::this_thread::sleep_for(std::chrono::milliseconds(2));
  return value;
}

namespace retrograde {
namespace {

Target profiled() { return get_jit_target_from_environment().with_feature(Target::Profile); }

struct Slow {
  Var x{"x"};
  Param<int> limit{"limit"};
  Func slow{"slow"}, quick{"quick"}, out{"out"};
  std::string report;
  Slow() {
    slow(x) = ir::call_extern("profiler_test_sleep", Int(32), {x});
    quick(x) = x * 2;
    out(x) = require(slow(x) < limit, slow(x) + quick(x), "too large");
    slow.compute_root();
    quick.compute_root();
    limit.set(1000);
    out.jit_handlers().print = [this](const char* text) { report += text; };
  }
};

TEST(Profiler, TheTableNamesTimeThreadsAndMemoryOfEveryFunc) {
  Slow program;
  Buffer<int> result = program.out.realize({40}, profiled());
  for (int i = 0; i < 40; i++) EXPECT_EQ(result(i), 3 * i);
  const std::string& text = program.report;
  for (const char* part : {"total time:", "runs: 1", "average threads used:", "peak memory:",
                           "slow", "threads:", "peak: 160 bytes"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
}

TEST(Profiler, TimeGoesToTheFuncThatTakesIt) {
  retrograde_context context = {};
  const char* funcs = "overhead\na\nb";
  retrograde_profiler_reset();
  void* run = retrograde_profiler_begin(&context, "pipeline", funcs);
  int32_t* place = retrograde_profiler_thread(&context, run, 1);
  retrograde_profiler_memory(&context, run, 1, 1000);
  std::this_thread::sleep_for(std::chrono::milliseconds(180));
  std::atomic_ref(*place).store(2);
  retrograde_profiler_memory(&context, run, 2, 500);
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  retrograde_profiler_memory(&context, run, 1, -1000);
  retrograde_profiler_leave(&context, place);
  retrograde_profiler_end(&context, run);
  const auto* stats = retrograde_profiler_pipeline("pipeline");
  ASSERT_NE(stats, nullptr);
  ASSERT_EQ(stats->num_funcs, 3);
  EXPECT_EQ(stats->runs, 1);
  EXPECT_GE(stats->time, 240000000u);
  EXPECT_STREQ(stats->funcs[1].name, "a");
  EXPECT_GT(stats->funcs[1].time, stats->funcs[2].time);
  EXPECT_GE(stats->funcs[2].time, 30000000u);  // half of it; samples come at random
  EXPECT_EQ(stats->funcs[1].memory_peak, 1000u);
  EXPECT_EQ(stats->funcs[2].num_allocs, 1);
  EXPECT_EQ(stats->memory_peak, 1500u);
  EXPECT_GT(stats->samples, 0);
  EXPECT_EQ(retrograde_profiler_pipeline("no such"), nullptr);
}

TEST(Profiler, RunsOnSeveralThreadsAddUp) {
  retrograde_profiler_reset();
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; t++) {
    threads.emplace_back([] {
      for (int i = 0; i < 10; i++) {
        void* run = retrograde_profiler_begin(nullptr, "many", "overhead\na");
        int32_t* place = retrograde_profiler_thread(nullptr, run, 1);
        retrograde_profiler_memory(nullptr, run, 1, 64);
        retrograde_profiler_leave(nullptr, place);
        retrograde_profiler_end(nullptr, run);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const auto* stats = retrograde_profiler_pipeline("many");
  ASSERT_NE(stats, nullptr);
  EXPECT_EQ(stats->runs, 40);
  EXPECT_EQ(stats->memory_peak, 64u);
}

TEST(Profiler, ThreadsShareTheTimeAndWhoWaitsForWorkOfItsOwnHasNone) {
  retrograde_profiler_reset();
  void* run = retrograde_profiler_begin(nullptr, "shared", "overhead\nouter\ninner\nother");
  int32_t* outer = retrograde_profiler_thread(nullptr, run, 1);
  int32_t* inner = retrograde_profiler_thread(nullptr, run, 2);
  std::thread other([&] {
    int32_t* place = retrograde_profiler_thread(nullptr, run, 3);
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    retrograde_profiler_leave(nullptr, place);
  });
  other.join();
  retrograde_profiler_leave(nullptr, inner);
  EXPECT_EQ(std::atomic_ref(*outer).load(), 1);
  // A nested run has a state of its own, and the outer one waits.
  void* other_run = retrograde_profiler_begin(nullptr, "other", "overhead");
  int32_t* elsewhere = retrograde_profiler_thread(nullptr, other_run, 0);
  EXPECT_LT(std::atomic_ref(*outer).load(), 0);
  retrograde_profiler_leave(nullptr, elsewhere);
  retrograde_profiler_end(nullptr, other_run);
  EXPECT_EQ(std::atomic_ref(*outer).load(), 1);
  retrograde_profiler_leave(nullptr, outer);
  retrograde_profiler_end(nullptr, run);
  const auto* stats = retrograde_profiler_pipeline("shared");
  ASSERT_NE(stats, nullptr);
  EXPECT_LT(stats->funcs[1].time, stats->time / 10);
  EXPECT_GT(stats->funcs[2].time, stats->time / 3);
  EXPECT_GT(stats->funcs[3].time, stats->time / 3);
}

TEST(Profiler, RunsShorterThanTheTimeBetweenLooksAreSeen) {
  retrograde_profiler_reset();
  const auto begin = std::chrono::steady_clock::now();
  const auto busy = [](std::chrono::microseconds time) {
    const auto start = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - start < time) {
    }
  };
  const auto is_seen = [](int func) {
    const auto* stats = retrograde_profiler_pipeline("short");
    return stats && stats->funcs[func].time > stats->time / 8;
  };
  // On a busy machine the sampling thread waits for its turn, so this runs longer then.
  for (int n = 0; n < 1000 || !is_seen(1) || !is_seen(2); ++n) {
    if (std::chrono::steady_clock::now() - begin > std::chrono::seconds(20)) break;
    void* run = retrograde_profiler_begin(nullptr, "short", "overhead\nfirst\nsecond");
    int32_t* place = retrograde_profiler_thread(nullptr, run, 1);
    busy(std::chrono::microseconds(200));
    std::atomic_ref(*place).store(2);
    busy(std::chrono::microseconds(200));
    retrograde_profiler_leave(nullptr, place);
    retrograde_profiler_end(nullptr, run);
  }
  EXPECT_TRUE(is_seen(1));
  EXPECT_TRUE(is_seen(2));
}

TEST(Profiler, AnErrorEndsTheRun) {
  Slow program;
  program.limit.set(3);
  EXPECT_THROW(program.out.realize({10}, profiled()), RuntimeError);
  expect_mentions(program.report, {"runs: 1"});
}

TEST(Profiler, ParallelLoopsCountTheirThreads) {
  Var x("x"), y("y");
  Func f("f"), out("out");
  f(x, y) = ir::call_extern("profiler_test_sleep", Int(32), {x + y});
  out(x, y) = f(x, y) + 1;
  f.compute_at(out, y);
  out.parallel(y);
  std::string report;
  out.jit_handlers().print = [&](const char* text) { report += text; };
  Buffer<int> result = out.realize({2, 16}, profiled());
  EXPECT_EQ(result(1, 15), 17);
  expect_mentions(report, {"f", "average threads used:"});
}

TEST(Profiler, AnErrorInATaskLeavesItsThreadFree) {
  Var x("x"), y("y");
  Param<int> limit("limit");
  Func f("f"), out("out");
  f(x, y) = ir::call_extern("profiler_test_sleep", Int(32), {x + y});
  out(x, y) = require(f(x, y) < limit, f(x, y), "too large");
  f.compute_at(out, y);
  out.parallel(y);
  std::string report;
  out.jit_handlers().print = [&](const char* text) { report += text; };
  limit.set(5);
  EXPECT_THROW(out.realize({2, 16}, profiled()), RuntimeError);
  limit.set(1000);
  report.clear();
  out.realize({2, 16}, profiled());
  expect_mentions(report, {"runs: 1", "f", "average threads used:"});
}

}  // namespace
}  // namespace retrograde

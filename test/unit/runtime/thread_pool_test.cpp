// The static runtime's thread pool.
#include "thread_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "retrograde_runtime.h"
#include "threads.h"

namespace retrograde::runtime {
namespace {

class ThreadPool : public testing::Test {
 protected:
  ThreadPool() { set_thread_count(4); }
  ~ThreadPool() override {
    shut_down_threads();
    set_thread_count(0);
  }
};

template <typename Body>
void run(int64_t extent, int32_t limit, Body body) {
  const auto call = [](void* data, int64_t begin, int64_t end) {
    (*static_cast<Body*>(data))(begin, end);
  };
  run_on_threads(extent, limit, call, &body);
}

TEST_F(ThreadPool, RunsEveryIterationOnce) {
  for (const int64_t extent : {1, 2, 3, 17, 1000, 100000}) {
    std::vector<std::atomic<int>> runs(static_cast<size_t>(extent));
    run(extent, 0, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; i++) runs[static_cast<size_t>(i)]++;
    });
    for (const auto& count : runs) ASSERT_EQ(count, 1);
  }
}

TEST_F(ThreadPool, LoopsMayNest) {
  std::atomic<int64_t> sum{0};
  run(20, 0, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; i++) {
      run(20, 0, [&](int64_t inner_begin, int64_t inner_end) {
        for (int64_t j = inner_begin; j < inner_end; j++) {
          run(5, 0, [&](int64_t first, int64_t last) { sum += last - first; });
        }
      });
    }
  });
  EXPECT_EQ(sum, 20 * 20 * 5);
}

TEST_F(ThreadPool, WhatTheLoopWroteIsSeenAfterIt) {
  for (int repeat = 0; repeat < 50; repeat++) {
    std::vector<int> values(256, 0);
    run(256, 0, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; i++) values[static_cast<size_t>(i)] = repeat;
    });
    for (const int value : values) ASSERT_EQ(value, repeat);
  }
}

TEST_F(ThreadPool, ALimitHolds) {
  std::atomic<int> inside{0}, most{0};
  run(200, 2, [&](int64_t begin, int64_t end) {
    const int now = ++inside;
    for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
    }
    for (int64_t i = begin; i < end; i++) std::this_thread::yield();
    inside--;
  });
  EXPECT_LE(most, 2);
}

TEST_F(ThreadPool, SeveralThreadsMayStartLoops) {
  std::atomic<int64_t> sum{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; t++) {
    threads.emplace_back([&] {
      for (int i = 0; i < 50; i++)
        run(64, 0, [&](int64_t begin, int64_t end) { sum += end - begin; });
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(sum, 4 * 50 * 64);
}

TEST_F(ThreadPool, StartsAgainAfterItsEnd) {
  for (int i = 0; i < 5; i++) {
    std::atomic<int64_t> sum{0};
    run(100, 0, [&](int64_t begin, int64_t end) { sum += end - begin; });
    EXPECT_EQ(sum, 100);
    shut_down_threads();
  }
}

// Threads spin for a while before they sleep; both ways of waiting must notice new work.
TEST_F(ThreadPool, WorkersThatSleptTakeLoops) {
  for (int repeat = 0; repeat < 8; repeat++) {
    std::atomic<int> inside{0};
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    run(2, 0, [&](int64_t begin, int64_t end) {  // ends only when a worker has arrived
      inside += static_cast<int>(end - begin);
      while (inside < 2 && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
    });
    EXPECT_EQ(inside, 2);
    EXPECT_LT(std::chrono::steady_clock::now(), deadline);
    std::this_thread::sleep_for(std::chrono::milliseconds(repeat));
  }
}

TEST_F(ThreadPool, StartersThatSleepAreWoken) {
  const std::thread::id starter = std::this_thread::get_id();
  for (int repeat = 0; repeat < 5; repeat++) {
    std::atomic<int> done{0};
    run(4, 0, [&](int64_t begin, int64_t end) {
      if (std::this_thread::get_id() != starter)
        std::this_thread::sleep_for(std::chrono::milliseconds(5 * repeat));
      done += static_cast<int>(end - begin);
    });
    EXPECT_EQ(done, 4);
  }
}

// The starter's iteration ends as soon as a worker runs the other one.
TEST_F(ThreadPool, StartersThatWaitHelpInTheLoopsInsideOfTheirs) {
  using namespace std::chrono_literals;
  set_thread_count(2);
  const auto starter = std::this_thread::get_id();
  for (const auto pause :
       {0ms, 20ms}) {  // before the inner loop starts: the starter spins, or sleeps
    std::atomic<bool> worker_is_there{false}, starter_helps{false};
    run(2, 0, [&](int64_t, int64_t) {
      if (std::this_thread::get_id() == starter) {
        while (!worker_is_there) std::this_thread::sleep_for(1ms);
        return;
      }
      worker_is_there = true;
      std::this_thread::sleep_for(pause);
      run(100, 0, [&](int64_t begin, int64_t end) {
        std::this_thread::sleep_for((end - begin) * 1ms);
        if (std::this_thread::get_id() == starter) starter_helps = true;
      });
    });
    EXPECT_TRUE(starter_helps) << pause.count();
  }
}

// Other loops may take long.
TEST_F(ThreadPool, StartersThatWaitLeaveOtherLoopsAlone) {
  using namespace std::chrono_literals;
  set_thread_count(2);
  const auto starter = std::this_thread::get_id();
  std::atomic<bool> worker_is_there{false}, other_is_over{false}, starter_helps{false};
  std::thread other([&] {
    while (!worker_is_there) std::this_thread::sleep_for(1ms);
    std::this_thread::sleep_for(20ms);
    run(100, 0, [&](int64_t begin, int64_t end) {
      std::this_thread::sleep_for((end - begin) * 1ms);
      if (std::this_thread::get_id() == starter) starter_helps = true;
    });
    other_is_over = true;
  });
  run(2, 0, [&](int64_t, int64_t) {
    if (std::this_thread::get_id() == starter) {
      while (!worker_is_there) std::this_thread::sleep_for(1ms);
      return;
    }
    worker_is_there = true;
    while (!other_is_over) std::this_thread::sleep_for(1ms);
  });
  other.join();
  EXPECT_FALSE(starter_helps);
}

TEST_F(ThreadPool, TheLowestFailureWins) {
  retrograde_context context = {};
  std::string message;
  context.user_data = &message;
  context.error_handler = [](retrograde_context* c, int, const char* text) {
    *static_cast<std::string*>(c->user_data) = text;
  };
  const auto task = [](retrograde_context* c, int32_t index, uint8_t*) -> int32_t {
    if (index < 37) return 0;
    return retrograde_report_error(c, -100 - index, "at %i", int64_t{index});
  };
  for (int repeat = 0; repeat < 20; repeat++) {
    EXPECT_EQ(retrograde_parallel_for(&context, task, 0, 500, nullptr), -137);
    EXPECT_EQ(message, "at 37");
  }
}

}  // namespace
}  // namespace retrograde::runtime

// The records of the profiler: the runs of pipelines, and the totals of each pipeline over its runs.
#pragma once

#include <HalideRuntime.h>

#include <atomic>
#include <chrono>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace retrograde::runtime::profile {

using Clock = std::chrono::steady_clock;

// Totals of one pipeline over all its runs.
struct Pipeline {
  std::string name;
  std::vector<std::string> func_names;
  std::vector<halide_profiler_func_stats> funcs;
  std::vector<double> samples;  // by Func
  halide_profiler_pipeline_stats stats = {};

  void link(Pipeline* next) {
    for (size_t i = 0; i < funcs.size(); i++) funcs[i].name = func_names[i].c_str();
    stats.name = name.c_str();
    stats.funcs = funcs.data();
    stats.num_funcs = static_cast<int>(funcs.size());
    stats.next = next ? &next->stats : nullptr;
  }
};

// Memory that is allocated by a Func or a run.
struct Memory {
  std::atomic<int64_t> current{0}, peak{0}, total{0};
  std::atomic<int32_t> allocations{0};

  void change(int64_t bytes) {
    const int64_t now = current.fetch_add(bytes, std::memory_order_relaxed) + bytes;
    if (bytes <= 0) return;
    total.fetch_add(bytes, std::memory_order_relaxed);
    allocations.fetch_add(1, std::memory_order_relaxed);
    int64_t highest = peak.load(std::memory_order_relaxed);
    while (now > highest && !peak.compare_exchange_weak(highest, now, std::memory_order_relaxed)) {
    }
  }
};

// Where one thread publishes the Func that it computes, on a cache line that no other thread writes. A thread that
// takes on nested work keeps its previous place and computes nothing there meanwhile.
struct alignas(64) Place {
  static constexpr int32_t idle = -1;
  struct Outer {
    Place* place;
    int32_t func;
  };
  int32_t current = idle;  // first: generated code has the place's address
  std::thread::id owner = std::this_thread::get_id();
  std::vector<Outer> outer;

  int32_t read() { return std::atomic_ref(current).load(std::memory_order_relaxed); }
  void write(int32_t func) { std::atomic_ref(current).store(func, std::memory_order_relaxed); }
};

// One call of a pipeline.
struct Run {
  explicit Run(Pipeline& pipeline);

  Pipeline& pipeline;
  const uint64_t serial;  // unique in the process
  std::mutex mutex;       // protects `places`
  std::deque<Place> places;
  std::vector<Memory> memory;  // by Func
  Memory all_memory;
  Clock::time_point begin = Clock::now();

  Place* place_of_this_thread();
  // The caller of these two holds the lock of the totals.
  // Records which Func each thread computes now.
  void sample();
  // Adds the run, which ends now, to the pipeline's totals.
  void finish();
};

// The calling thread starts to compute a Func of the run. Returns its place; a null run is not sampled.
int32_t* enter_thread(Run*, int32_t func);
// Ends what enter_thread began.
void leave_thread(int32_t* place);

}  // namespace retrograde::runtime::profile

// A sampling profiler: every millisecond it samples which Func each thread of a running pipeline computes.
//
// Generated code only stores a number in its thread's place, so it is hardly slower. One sampling thread serves all
// runs; it starts with the first and ends with the last. The intervals between samples are random and exponentially
// distributed. Then every moment of a run is equally likely to be sampled, however short the run is and whatever it
// repeats ("Poisson arrivals see time averages", R. Wolff, Operations Research 30, 1982). Each sample is divided among
// the threads that are working, and a pipeline's time is divided among its Funcs in proportion to their samples.
// Results are kept by pipeline, in the structs of HalideRuntime.h.
#include <HalideRuntime.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "inquiries.h"
#include "report.h"

namespace retrograde::runtime {
namespace {

using Clock = std::chrono::steady_clock;

uint64_t nanoseconds(Clock::duration d) {
  return static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(d).count());
}

// Totals of one pipeline over all its runs.
struct Pipeline {
  std::string name;
  std::vector<std::string> func_names;
  std::vector<halide_profiler_func_stats> funcs;
  std::vector<double> looks;  // samples, by Func
  halide_profiler_pipeline_stats stats = {};

  void link(Pipeline* next) {
    for (size_t i = 0; i < funcs.size(); i++) funcs[i].name = func_names[i].c_str();
    stats.name = name.c_str();
    stats.funcs = funcs.data();
    stats.num_funcs = static_cast<int>(funcs.size());
    stats.next = next ? &next->stats : nullptr;
  }
};

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

uint64_t next_serial() {
  static std::atomic<uint64_t> last{0};
  return ++last;
}

// One call.
struct Run {
  Run(Pipeline& pipeline, size_t count) : pipeline(pipeline), memory(count) {}
  Pipeline& pipeline;
  const uint64_t serial = next_serial();
  std::mutex mutex;  // protects `places`
  std::deque<Place> places;
  std::vector<Memory> memory;  // by Func
  Memory all;
  Clock::time_point begin = Clock::now();

  Place* place_of_this_thread() {
    const std::lock_guard lock(mutex);
    for (Place& place : places) {
      if (place.owner == std::this_thread::get_id()) return &place;
    }
    return &places.emplace_back();
  }
};

thread_local Place* innermost = nullptr;  // the place that the thread is in
thread_local Place nowhere;               // for runs that are not profiled

// The thread's most recent place. A loop of many short tasks asks for the same place repeatedly; this avoids the lock.
struct LatestPlace {
  uint64_t run = 0;
  Place* place = nullptr;  // valid as long as that run lives
};
thread_local LatestPlace latest;

int32_t* enter_thread(Run* run, int32_t func) {
  if (!run) return &nowhere.current;
  if (latest.run != run->serial) latest = {run->serial, run->place_of_this_thread()};
  Place* place = latest.place;
  place->outer.push_back({innermost, innermost ? innermost->read() : Place::idle});
  if (innermost) innermost->write(Place::idle);
  place->write(func);
  innermost = place;
  return &place->current;
}

void leave_thread(int32_t* at) {
  if (!at || at == &nowhere.current) return;
  Place* place = reinterpret_cast<Place*>(at);
  const Place::Outer outer = place->outer.back();
  place->outer.pop_back();
  place->write(Place::idle);
  innermost = outer.place;
  if (innermost) innermost->write(outer.func);
}

class Profiler {
 public:
  Run* begin(const char* name, const char* funcs) {
    const std::lock_guard lock(mutex_);
    Pipeline& pipeline = find(name, funcs);
    runs_.push_back(std::make_unique<Run>(pipeline, pipeline.funcs.size()));
    if (runs_.size() == 1) start();
    return runs_.back().get();
  }

  void end(Run* run) {
    std::thread finished;
    {
      const std::lock_guard lock(mutex_);
      keep(*run, Clock::now());
      std::erase_if(runs_, [&](const auto& other) { return other.get() == run; });
      if (runs_.empty()) finished = stop();
    }
    if (finished.joinable()) finished.join();
  }

  void reset() {
    const std::lock_guard lock(mutex_);
    for (auto& pipeline : pipelines_) {
      for (size_t i = 0; i < pipeline->funcs.size(); i++) pipeline->funcs[i] = {};
      pipeline->looks.assign(pipeline->funcs.size(), 0);
      pipeline->stats = {};
    }
    link();
  }

  std::string report() {
    const std::lock_guard lock(mutex_);
    std::string text;
    for (const auto& pipeline : pipelines_) {
      if (pipeline->stats.runs > 0) text += report_of(*pipeline);
    }
    return text;
  }

  halide_profiler_pipeline_stats* find(const char* name) {
    const std::lock_guard lock(mutex_);
    for (auto& pipeline : pipelines_) {
      if (pipeline->name == name) return &pipeline->stats;
    }
    return nullptr;
  }

  halide_profiler_state* state() { return &state_; }

 private:
  std::mutex mutex_;
  halide_profiler_state state_ = initial_state();
  std::condition_variable wake_;
  std::vector<std::unique_ptr<Pipeline>> pipelines_;  // the latest first
  std::vector<std::unique_ptr<Run>> runs_;
  std::thread thread_;
  uint64_t generation_ = 0;  // identifies the sampling thread
  uint64_t random_ = 1;

  static halide_profiler_state initial_state() {
    halide_profiler_state state = {};
    state.sleep_time = 1;
    state.current_func = halide_profiler_outside_of_halide;
    return state;
  }

  Pipeline& find(const char* name, const char* funcs) {
    std::vector<std::string> names;
    for (const char* at = funcs; at;) {
      const char* end = std::strchr(at, '\n');
      names.emplace_back(at, end ? static_cast<size_t>(end - at) : std::strlen(at));
      at = end ? end + 1 : nullptr;
    }
    for (auto& pipeline : pipelines_) {
      if (pipeline->name == name && pipeline->func_names == names) return *pipeline;
    }
    auto pipeline = std::make_unique<Pipeline>();
    pipeline->name = name;
    pipeline->func_names = std::move(names);
    pipeline->funcs.resize(pipeline->func_names.size());
    pipeline->looks.resize(pipeline->func_names.size());
    pipelines_.insert(pipelines_.begin(), std::move(pipeline));
    link();
    return *pipelines_.front();
  }

  void link() {
    for (size_t i = pipelines_.size(); i-- > 0;)
      pipelines_[i]->link(i + 1 < pipelines_.size() ? pipelines_[i + 1].get() : nullptr);
    state_.pipelines = pipelines_.empty() ? nullptr : &pipelines_.front()->stats;
  }

  void start() {
    try {
      thread_ = std::thread([this, generation = ++generation_] { look(generation); });
    } catch (...) {  // no thread: the total times of runs are still right
    }
  }

  std::thread stop() {
    generation_++;
    wake_.notify_all();
    return std::move(thread_);
  }

  void look(uint64_t generation) {
    std::unique_lock lock(mutex_);
    while (generation == generation_) {
      const auto until = Clock::now() + next_wait();
      if (wake_.wait_until(lock, until, [&] { return generation != generation_; })) return;
      for (auto& run : runs_) look_at(*run);
    }
  }

  // Exponentially distributed with mean sleep_time.
  std::chrono::microseconds next_wait() {
    random_ = random_ * 6364136223846793005u + 1442695040888963407u;  // D. Knuth, MMIX
    // -log2 of a number in (0, 1] with these bits, linear between powers of two, because libm is not linked.
    const int halvings = std::countl_zero(random_ | 1);
    const double rest = static_cast<double>(random_ << halvings << 1) * 0x1p-64;
    const double mean = 1000.0 * std::max(1, state_.sleep_time);
    return std::chrono::microseconds(static_cast<int64_t>((halvings + 1 - rest) * 0.6931 * mean));
  }

  static void look_at(Run& run) {
    const std::lock_guard lock(run.mutex);
    std::vector<uint64_t> threads(run.pipeline.funcs.size());
    uint64_t all = 0;
    for (Place& place : run.places) {
      const int32_t func = place.read();
      if (func < 0) continue;
      threads[static_cast<size_t>(func)]++;
      all++;
    }
    if (all == 0) threads[0] = all = 1;
    auto& stats = run.pipeline.stats;
    for (size_t i = 0; i < threads.size(); i++) {
      if (threads[i] == 0) continue;
      auto& func = run.pipeline.funcs[i];
      run.pipeline.looks[i] += static_cast<double>(threads[i]) / static_cast<double>(all);
      func.active_threads_numerator += threads[i];
      func.active_threads_denominator++;
    }
    stats.active_threads_numerator += all;
    stats.active_threads_denominator++;
    stats.samples++;
  }

  // The time of a pipeline that was never sampled is overhead, because nothing is known about it.
  static void share_time(Pipeline& pipeline) {
    const auto time = static_cast<double>(pipeline.stats.time);
    const int looks = pipeline.stats.samples;
    for (size_t i = 0; i < pipeline.funcs.size(); i++)
      pipeline.funcs[i].time = looks ? static_cast<uint64_t>(time * pipeline.looks[i] / looks) : 0;
    if (looks == 0) pipeline.funcs[0].time = pipeline.stats.time;
  }

  static void keep(const Run& run, Clock::time_point now) {
    auto& stats = run.pipeline.stats;
    stats.time += nanoseconds(now - run.begin);
    stats.runs++;
    share_time(run.pipeline);
    const auto add = [](auto& to, const Memory& from) {
      to.memory_peak =
          std::max(to.memory_peak, static_cast<uint64_t>(std::max<int64_t>(0, from.peak)));
      to.memory_total += static_cast<uint64_t>(from.total.load());
      to.num_allocs += from.allocations.load();
    };
    for (size_t i = 0; i < run.memory.size(); i++) add(run.pipeline.funcs[i], run.memory[i]);
    add(stats, run.all);
  }

  // ---- the table ----

  template <typename... Args>
  static std::string line(const char* format, Args... args) {
    char text[max_message_bytes];
    return std::string(text, retrograde_format_message(text, sizeof text, format, args...));
  }
  static double milliseconds(uint64_t time) {
    return static_cast<double>(time / 1000) / 1000.0;  // whole microseconds
  }
  static double threads(uint64_t numerator, uint64_t denominator) {
    if (denominator == 0) return 1.0;
    return static_cast<double>(10 * numerator / denominator) / 10.0;
  }
  static std::string padded(std::string text, size_t width) {
    if (text.size() < width) text.resize(width, ' ');
    return text;
  }

  static std::string report_of(const Pipeline& p) {
    const auto& s = p.stats;
    const auto runs = static_cast<uint64_t>(s.runs);
    std::string text = line("%s\n", p.name.c_str());
    text += line(" total time: %f ms  samples: %i  runs: %i  time/run: %f ms\n",
                 milliseconds(s.time), static_cast<int64_t>(s.samples),
                 static_cast<int64_t>(s.runs), milliseconds(s.time / std::max<uint64_t>(1, runs)));
    text += line(" average threads used: %f\n",
                 threads(s.active_threads_numerator, s.active_threads_denominator));
    text += line(" allocations: %i  peak memory: %u bytes\n", static_cast<int64_t>(s.num_allocs),
                 s.memory_peak);
    size_t width = 0;
    for (const std::string& name : p.func_names) width = std::max(width, name.size());
    for (const auto& f : p.funcs) {
      if (f.time == 0 && f.num_allocs == 0) continue;
      const uint64_t percent = s.time ? 100 * f.time / s.time : 0;
      const std::string time =
          line("%f ms (%u%%)", milliseconds(f.time / std::max<uint64_t>(1, runs)), percent);
      text += "  " + padded(std::string(f.name) + ":", width + 2) + padded(time, 22);
      text +=
          line("threads: %f", threads(f.active_threads_numerator, f.active_threads_denominator));
      if (f.num_allocs > 0)
        text += line("  peak: %u bytes  allocations: %i", f.memory_peak,
                     static_cast<int64_t>(f.num_allocs));
      text += "\n";
    }
    return text;
  }
};

Profiler& profiler() {
  static Profiler& instance =
      *new Profiler;  // never destroyed: runs may end while the process exits
  return instance;
}

}  // namespace
}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

void* retrograde_profiler_begin(retrograde_context*, const char* pipeline, const char* funcs) {
  try {
    return rt::profiler().begin(pipeline, funcs);
  } catch (const std::bad_alloc&) {  // this run is not profiled
    return nullptr;
  }
}

int32_t* retrograde_profiler_thread(retrograde_context*, void* run, int32_t func) {
  try {
    return rt::enter_thread(static_cast<rt::Run*>(run), func);
  } catch (const std::bad_alloc&) {  // this thread is not sampled
    return rt::enter_thread(nullptr, func);
  }
}

int32_t retrograde_profiler_leave(retrograde_context*, int32_t* place) {
  rt::leave_thread(place);
  return 0;
}

int32_t retrograde_profiler_memory(retrograde_context*, void* run, int32_t func, int64_t change) {
  if (!run) return 0;
  auto& r = *static_cast<rt::Run*>(run);
  r.memory[static_cast<size_t>(func)].change(change);
  r.all.change(change);
  return 0;
}

int32_t retrograde_profiler_end(retrograde_context*, void* run) {
  if (run) rt::profiler().end(static_cast<rt::Run*>(run));
  return 0;
}

void retrograde_profiler_reset(void) { rt::profiler().reset(); }

void retrograde_profiler_report(retrograde_context* context) {
  if (!context || !context->print_handler) return;
  try {
    const std::string text = rt::profiler().report();
    if (!text.empty()) context->print_handler(context, text.c_str());
  } catch (const std::bad_alloc&) {
  }
}

struct halide_profiler_state* retrograde_profiler_state(void) {
  return rt::profiler().state();
}

struct halide_profiler_pipeline_stats* retrograde_profiler_pipeline(const char* name) {
  return rt::profiler().find(name);
}

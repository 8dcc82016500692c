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
#include <bit>
#include <condition_variable>
#include <cstring>
#include <memory>
#include <new>

#include "inquiries.h"
#include "profile.h"
#include "profile_report.h"
#include "retrograde_runtime.h"

namespace retrograde::runtime {
namespace {

using namespace profile;

class Profiler {
 public:
  Run* begin(const char* name, const char* funcs) {
    const std::lock_guard lock(mutex_);
    Pipeline& pipeline = find(name, funcs);
    runs_.push_back(std::make_unique<Run>(pipeline));
    if (runs_.size() == 1) start();
    return runs_.back().get();
  }

  void end(Run* run) {
    std::thread finished;
    {
      const std::lock_guard lock(mutex_);
      run->finish();
      std::erase_if(runs_, [&](const auto& other) { return other.get() == run; });
      if (runs_.empty()) finished = stop();
    }
    if (finished.joinable()) finished.join();
  }

  void reset() {
    const std::lock_guard lock(mutex_);
    for (auto& pipeline : pipelines_) {
      for (size_t i = 0; i < pipeline->funcs.size(); i++) pipeline->funcs[i] = {};
      pipeline->samples.assign(pipeline->funcs.size(), 0);
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
    pipeline->samples.resize(pipeline->func_names.size());
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
      thread_ =
          std::thread([this, generation = ++generation_] { sample_until_stopped(generation); });
    } catch (...) {  // no thread: the total times of runs are still right
    }
  }

  std::thread stop() {
    generation_++;
    wake_.notify_all();
    return std::move(thread_);
  }

  void sample_until_stopped(uint64_t generation) {
    std::unique_lock lock(mutex_);
    while (generation == generation_) {
      const auto until = Clock::now() + next_wait();
      if (wake_.wait_until(lock, until, [&] { return generation != generation_; })) return;
      for (auto& run : runs_) run->sample();
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
};

Profiler& profiler() {
  static Profiler& instance =
      *new Profiler;  // never destroyed: runs may end while the process exits
  return instance;
}

}  // namespace
}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;
namespace profile = rt::profile;

void* retrograde_profiler_begin(retrograde_context*, const char* pipeline, const char* funcs) {
  try {
    return rt::profiler().begin(pipeline, funcs);
  } catch (const std::bad_alloc&) {  // this run is not profiled
    return nullptr;
  }
}

int32_t* retrograde_profiler_thread(retrograde_context*, void* run, int32_t func) {
  try {
    return profile::enter_thread(static_cast<profile::Run*>(run), func);
  } catch (const std::bad_alloc&) {  // this thread is not sampled
    return profile::enter_thread(nullptr, func);
  }
}

int32_t retrograde_profiler_leave(retrograde_context*, int32_t* place) {
  profile::leave_thread(place);
  return 0;
}

int32_t retrograde_profiler_memory(retrograde_context*, void* run, int32_t func, int64_t change) {
  if (!run) return 0;
  auto& r = *static_cast<profile::Run*>(run);
  r.memory[static_cast<size_t>(func)].change(change);
  r.all_memory.change(change);
  return 0;
}

int32_t retrograde_profiler_end(retrograde_context*, void* run) {
  if (run) rt::profiler().end(static_cast<profile::Run*>(run));
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

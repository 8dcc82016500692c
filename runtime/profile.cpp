// The records of the profiler.
#include "profile.h"

#include <algorithm>

namespace retrograde::runtime::profile {
namespace {

uint64_t nanoseconds(Clock::duration d) {
  return static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(d).count());
}

uint64_t next_serial() {
  static std::atomic<uint64_t> last{0};
  return ++last;
}

thread_local Place* innermost = nullptr;  // the place that the thread is in
thread_local Place nowhere;               // for runs that are not profiled

// The thread's most recent place. A loop of many short tasks asks for the same place repeatedly; this avoids the lock.
struct LatestPlace {
  uint64_t run = 0;
  Place* place = nullptr;  // valid as long as that run lives
};
thread_local LatestPlace latest;

// The time of a pipeline that was never sampled is overhead, because nothing is known about it.
void share_time(Pipeline& pipeline) {
  const auto time = static_cast<double>(pipeline.stats.time);
  const int samples = pipeline.stats.samples;
  for (size_t i = 0; i < pipeline.funcs.size(); i++)
    pipeline.funcs[i].time =
        samples ? static_cast<uint64_t>(time * pipeline.samples[i] / samples) : 0;
  if (samples == 0) pipeline.funcs[0].time = pipeline.stats.time;
}

}  // namespace

Run::Run(Pipeline& pipeline)
    : pipeline(pipeline), serial(next_serial()), memory(pipeline.funcs.size()) {}

Place* Run::place_of_this_thread() {
  const std::lock_guard lock(mutex);
  for (Place& place : places) {
    if (place.owner == std::this_thread::get_id()) return &place;
  }
  return &places.emplace_back();
}

void Run::sample() {
  const std::lock_guard lock(mutex);
  std::vector<uint64_t> threads(pipeline.funcs.size());
  uint64_t all = 0;
  for (Place& place : places) {
    const int32_t func = place.read();
    if (func < 0) continue;
    threads[static_cast<size_t>(func)]++;
    all++;
  }
  if (all == 0) threads[0] = all = 1;
  auto& stats = pipeline.stats;
  for (size_t i = 0; i < threads.size(); i++) {
    if (threads[i] == 0) continue;
    auto& func = pipeline.funcs[i];
    pipeline.samples[i] += static_cast<double>(threads[i]) / static_cast<double>(all);
    func.active_threads_numerator += threads[i];
    func.active_threads_denominator++;
  }
  stats.active_threads_numerator += all;
  stats.active_threads_denominator++;
  stats.samples++;
}

void Run::finish() {
  auto& stats = pipeline.stats;
  stats.time += nanoseconds(Clock::now() - begin);
  stats.runs++;
  share_time(pipeline);
  const auto add = [](auto& to, const Memory& from) {
    to.memory_peak =
        std::max(to.memory_peak, static_cast<uint64_t>(std::max<int64_t>(0, from.peak)));
    to.memory_total += static_cast<uint64_t>(from.total.load());
    to.num_allocs += from.allocations.load();
  };
  for (size_t i = 0; i < memory.size(); i++) add(pipeline.funcs[i], memory[i]);
  add(stats, all_memory);
}

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

}  // namespace retrograde::runtime::profile

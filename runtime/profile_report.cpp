// The profiler's table for one pipeline.
#include "profile_report.h"

#include <algorithm>

#include "report.h"

namespace retrograde::runtime::profile {
namespace {

template <typename... Args>
std::string line(const char* format, Args... args) {
  char text[max_message_bytes];
  return std::string(text, retrograde_format_message(text, sizeof text, format, args...));
}
double milliseconds(uint64_t time) {
  return static_cast<double>(time / 1000) / 1000.0;  // whole microseconds
}
double threads(uint64_t numerator, uint64_t denominator) {
  if (denominator == 0) return 1.0;
  return static_cast<double>(10 * numerator / denominator) / 10.0;
}
std::string padded(std::string text, size_t width) {
  if (text.size() < width) text.resize(width, ' ');
  return text;
}

}  // namespace

std::string report_of(const Pipeline& p) {
  const auto& s = p.stats;
  const auto runs = static_cast<uint64_t>(s.runs);
  std::string text = line("%s\n", p.name.c_str());
  text += line(" total time: %f ms  samples: %i  runs: %i  time/run: %f ms\n", milliseconds(s.time),
               static_cast<int64_t>(s.samples), static_cast<int64_t>(s.runs),
               milliseconds(s.time / std::max<uint64_t>(1, runs)));
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
    text += line("threads: %f", threads(f.active_threads_numerator, f.active_threads_denominator));
    if (f.num_allocs > 0)
      text += line("  peak: %u bytes  allocations: %i", f.memory_peak,
                   static_cast<int64_t>(f.num_allocs));
    text += "\n";
  }
  return text;
}

}  // namespace retrograde::runtime::profile

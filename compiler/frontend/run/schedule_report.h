// schedule_report.h -- what a schedule costs, by stages: Pipeline::explain_schedule.
//
//   std::cout << pipeline.explain_schedule(target, {1920, 1080}, {.measure = true}).to_string();
//
// The times are predicted by a model of the machine (docs/autoscheduler.md) and, where that is asked for,
// measured beside it with the inputs that are bound.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "frontend/run/kernel_report.h"

namespace retrograde {

struct ExplainOptions {
  // Compiles it with the profiler and runs it. The profiler looks every millisecond what is computed:
  // a stage of a hundredth of the time is known within a fifth after 2 s.
  bool measure = false;
  double seconds = 2;  // that it runs, at least 5 times
  int threads = 0;     // 0: all
  // Which other schedule the model thinks best, as AutoscheduleOptions::search would find it, and
  // what it takes. Of what was scheduled with that option it is told anyway.
  bool runner_up = false;
};

// What a search for a schedule found (AutoscheduleOptions::search).
struct SearchedSchedules {
  size_t tried = 0;                       // different schedules; 0: none was searched for
  double rules_ms = 0, predicted_ms = 0;  // of what the rules choose, and of what was taken
  std::optional<double> runner_up_ms;
  std::string
      runner_up;     // directives that differ: "- " before those of the schedule that was taken,
                     // "+ " before those of the runner-up
  std::string note;  // why there was no search, though it was asked for

  std::string to_string() const;
};

struct ScheduleReport {
  struct Stage {
    std::string name;  // of the Func; "" is what belongs to none
    double predicted_ms = 0;
    std::string bound_by;     // "compute", "L2", "L3", "memory": what its data come from; "launch"
    double bytes = 0;         // that come from or go to beyond the first cache
    double memory_bytes = 0;  // beyond all caches
    std::optional<double> measured_ms;  // of one run, together with what it is computed with
  };
  std::string schedule;  // as C++
  std::string machine;   // whose figures were used
  std::vector<Stage> stages;
  double predicted_ms = 0;
  double first_call_ms = 0;           // more, in a first call, for memory that is new
  std::optional<double> measured_ms;  // of the fastest run
  SearchedSchedules search;
  KernelReport kernels;  // whose own times are not predicted

  std::string to_string() const;
  std::string to_json() const;
};

}  // namespace retrograde

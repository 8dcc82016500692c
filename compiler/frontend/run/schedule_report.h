// schedule_report.h -- the cost of a schedule by stages, as Pipeline::explain_schedule reports it.
//
//   std::cout << pipeline.explain_schedule(target, {1920, 1080}, {.measure = true}).to_string();
//
// Times are predicted by the cost model (docs/autoscheduler.md). On request they are also measured, with the inputs
// that are bound.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "frontend/run/kernel_report.h"

namespace retrograde {

// Options of Pipeline::explain_schedule.
struct ExplainOptions {
  // Also compiles with the profiler and runs the pipeline. The profiler samples every millisecond; after 2 s
  // a stage with 1 % of the time is known to within 20 %.
  bool measure = false;
  double seconds = 2;  // duration of a measurement, with at least 5 runs
  int threads = 0;     // number of threads; 0: all
  // Also reports the best other schedule that a search (AutoscheduleOptions::search) would find, and its
  // predicted time. For a schedule that came from a search this is reported anyway.
  bool runner_up = false;
};

// Result of a search for a schedule (AutoscheduleOptions::search).
struct SearchedSchedules {
  size_t tried = 0;                         // number of different schedules; 0: no search
  double default_ms = 0, predicted_ms = 0;  // predicted: default schedule, chosen schedule
  std::optional<double> runner_up_ms;       // predicted time of the second best schedule
  // Directives that differ: "- " marks those of the chosen schedule, "+ " those of the runner-up.
  std::string runner_up;
  // Why a requested search did not run.
  std::string note;

  std::string to_string() const;  // the result as lines of text
};

// The cost of a schedule, by stages.
struct ScheduleReport {
  // The cost of one stage.
  struct Stage {
    std::string name;         // name of the Func; "": time that belongs to no Func
    double predicted_ms = 0;  // predicted time of one run
    std::string bound_by;     // limiting resource: "compute", "L2", "L3", "memory" or "launch"
    double bytes = 0;         // traffic beyond the first-level cache
    double memory_bytes = 0;  // traffic beyond all caches
    std::optional<double> measured_ms;  // of one run, including stages that are computed with it
  };
  std::string schedule;               // the directives as C++
  std::string machine;                // the machine whose figures the model used
  std::vector<Stage> stages;          // one for each stage
  double predicted_ms = 0;            // predicted time of one run
  double first_call_ms = 0;           // additional time of a first call, for memory that is new
  std::optional<double> measured_ms;  // time of the fastest run
  SearchedSchedules search;           // result of the search, if there was one
  KernelReport kernels;               // GPU kernels, whose times are not predicted

  std::string to_string() const;  // a table
  std::string to_json() const;    // the same data as JSON
};

}  // namespace retrograde

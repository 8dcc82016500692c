// schedule_search.h -- of the schedules that the rules can give, the one with the least cost.
//
//   rules             9.1 ms     without strips      8.7 ms     without strips, weight again  8.2 ms
//                             => without join_sweeps 9.4 ms  => without strips, f stored      9.0 ms
//                                weight again        9.0 ms     ...
//
// A beam search over what the rules decide: each decision made or not; numbers of theirs doubled or
// halved (tiles of registers, tasks, rows of strips, bytes of caches); and, of the Funcs that it
// matters most for, stored or computed again. It begins with what the rules choose and each step
// changes one of these, so that the result is never worse than theirs by the cost; it ends where a
// step brings nothing, or after so many schedules, never by the clock: the same program has the same
// schedule on every machine that has the same cost. Costs that are equal keep the earlier schedule.
// Source of the method: B. Lowerre, The Harpy Speech Recognition System, 1976 (beam search). That of
// Adams et al., Learning to Optimize Halide with Tree Search and Random Programs, SIGGRAPH 2019,
// builds schedules loop by loop; ours varies one that is whole, which needs a few dozen candidates.
#pragma once

#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "autoschedule/default_schedule.h"
#include "autoschedule/memory_budget.h"
#include "graph/directives/schedule_log.h"

namespace retrograde::autoschedule {

// Of a scheduled graph, the less the better. Several threads ask at once. Where it throws, the schedule
// is left out; that of the rules cannot be: search_schedule throws what its cost does.
using ScheduleCost = std::function<double(const std::vector<FuncPtr>& outputs)>;

struct SearchedSchedule {
  ScheduledGraph graph;
  ScheduleRequest request;  // that gives it
  double cost = std::numeric_limits<double>::infinity();
};

struct ScheduleSearch {
  SearchedSchedule best, runner_up;  // the latter without a graph where there was no other schedule
  SearchedSchedule rules;            // where it began
  double cost_of_rules = 0;
  size_t tried = 0;  // different schedules
};

// That are tried for a graph of so many Funcs: together they take about as long, whatever its size.
size_t candidates_for(size_t funcs);

// `outputs`: of a graph whose wrappers have been applied, which stays as it is. No schedule that takes
// more memory than the budget, unless that of the rules does. `candidates`: 0 for candidates_for.
ScheduleSearch search_schedule(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request,
                               Scheduling what, const ScheduleCost& cost, size_t candidates = 0);

// Its text, the same of each copy of a graph. Funcs that a schedule makes have another number in each:
// all names but those known are numbered anew, in their order; the first of a name in the process has
// no number yet.
std::string with_stable_names(const ScheduleLog& log, const std::set<std::string>& known);

// Directives that only one of them has, a line each: "- " for the first, "+ " for the second.
std::string difference_of(const ScheduleLog& first, const ScheduleLog& second);

}  // namespace retrograde::autoschedule

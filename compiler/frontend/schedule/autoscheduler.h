// autoscheduler.h -- functions that schedule a whole pipeline, by name.
//
// One is built in: pipeline.auto_schedule(target). It computes at root, in parallel and vectorized,
// what is dear to compute again, inlines the rest, and keeps what a user scheduled; what else it is
// told: autoschedule_options.h. Of the machine it takes threads and the last-level cache, unless they
// are the generic ones. Others live in libraries of their own, plugins, which register them when they are loaded:
// load_plugin("libgreedy.so"); pipeline.auto_schedule("Greedy", target).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "frontend/run/schedule_report.h"
#include "ir/target.h"

namespace retrograde {

class Pipeline;
struct AutoschedulerParams;
struct AutoSchedulerResults;

namespace frontend {
void add_autoscheduler(
    const std::string& name,
    const std::function<void(const Pipeline&, const Target&, const AutoschedulerParams&,
                             AutoSchedulerResults*)>& scheduler);
// The name of the one that is there for what is asked; a warning where it is another.
std::string scheduler_for(const AutoschedulerParams& params);
}  // namespace frontend

// The machine that a schedule is made for. As text: "parallelism,last_level_cache_size,balance".
struct MachineParams {
  int parallelism = 16;
  uint64_t last_level_cache_size = 16 * 1024 * 1024;
  float balance = 40;  // cost of a load from the last-level cache, in operations

  MachineParams() = default;
  MachineParams(int parallelism, uint64_t last_level_cache_size, float balance)
      : parallelism(parallelism), last_level_cache_size(last_level_cache_size), balance(balance) {}
  // Requires: they are the threads, the bytes of the last-level cache and the cost of a load.
  explicit MachineParams(const std::string& text);
  static MachineParams generic() { return {}; }
  std::string to_string() const;
  friend bool operator==(const MachineParams&, const MachineParams&) = default;
};

// A scheduler by name, with what it is told as text: parallelism, last_level_cache_size and balance
// are those of MachineParams. The names of Halide's schedulers mean the built-in one, which says so in
// a warning and does not know the rest of what they are told.
struct AutoschedulerParams {
  std::string name;
  std::map<std::string, std::string> extra;

  AutoschedulerParams() = default;
  AutoschedulerParams(const std::string& name, const std::map<std::string, std::string>& extra = {})
      : name(name), extra(extra) {}
  std::string to_string() const;  // autoscheduler=NAME autoscheduler.KEY=VALUE ...
};

struct AutoSchedulerResults {
  std::string scheduler_name;
  Target target;
  std::string machine_params_string;
  std::string schedule_source;  // the schedule as C++
  std::vector<uint8_t> featurization;
  // Of the built-in scheduler: the bytes that a call takes at most, inputs and outputs too, and what
  // was allowed. They may be more: then no schedule that it knows takes less. Sizes that are not known
  // count as nothing.
  int64_t memory_bytes = 0, memory_budget_bytes = 0;
  SearchedSchedules search;                  // with AutoscheduleOptions::search
  AutoschedulerParams autoscheduler_params;  // of apply_autoscheduler
};

using AutoSchedulerFn =
    std::function<void(const Pipeline& pipeline, const Target& target, const MachineParams& machine,
                       AutoSchedulerResults* results)>;

// A null function takes the name away.
void add_autoscheduler(const std::string& name, const AutoSchedulerFn& scheduler);
// One that is given all that it is told.
using AutoschedulerParamsFn =
    std::function<void(const Pipeline& pipeline, const Target& target,
                       const AutoschedulerParams& params, AutoSchedulerResults* results)>;
template <typename F>
requires(std::is_invocable_v<F, const Pipeline&, const Target&, const AutoschedulerParams&,
                             AutoSchedulerResults*>) void add_autoscheduler(const std::string& name,
                                                                            const F& scheduler) {
  frontend::add_autoscheduler(name, AutoschedulerParamsFn(scheduler));
}
// Names of all that are there.
std::vector<std::string> autoscheduler_names();
inline constexpr const char* built_in_autoscheduler = "Retrograde";
// The one that auto_schedule() without a name means: the built-in one, unless another was set; ""
// means that again.
// Requires: an autoscheduler is loaded from a plugin before it is used.
void set_default_autoscheduler_name(const std::string& name);
std::string default_autoscheduler_name();
// By its name; the error where there is none lists those that are there.
// Requires: autoschedulers have different names; an autoscheduler is loaded from a plugin before it
// is used.
AutoSchedulerFn find_autoscheduler(const std::string& name);
// Opens a shared library; its static initialisers register what it holds.
// Requires: it is a shared library that can be opened.
void load_plugin(const std::string& library);

}  // namespace retrograde

// autoscheduler.h -- registry of autoschedulers, functions that schedule a whole pipeline.
//
// pipeline.auto_schedule(target) runs the built-in one. It computes Funcs that are expensive to recompute at root, in
// parallel and vectorized, inlines the others, and keeps the directives of the user; autoschedule_options.h lists its
// options. From the MachineParams it takes threads and last-level cache, unless they are the generic values.
// Others are plugins: shared libraries that register their autoschedulers when they are loaded.
//   load_plugin("libgreedy.so");
//   pipeline.auto_schedule("Greedy", target);
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
// The registered name that `params` select; warns if it differs from the requested one.
std::string scheduler_for(const AutoschedulerParams& params);
}  // namespace frontend

// The machine that a schedule is for. As text: "parallelism,last_level_cache_size,balance".
struct MachineParams {
  int parallelism = 16;                               // number of threads
  uint64_t last_level_cache_size = 16 * 1024 * 1024;  // in bytes
  float balance = 40;  // operations per load from that cache; unused by the built-in autoscheduler

  MachineParams() = default;  // the generic machine
  MachineParams(int parallelism, uint64_t last_level_cache_size, float balance)
      : parallelism(parallelism), last_level_cache_size(last_level_cache_size), balance(balance) {}
  // Parses the text form.
  // Requires: they are the threads, the bytes of the last-level cache and the cost of a load.
  explicit MachineParams(const std::string& text);
  static MachineParams generic() { return {}; }  // the default values
  std::string to_string() const;                 // the text form
  // Whether all values are equal.
  friend bool operator==(const MachineParams&, const MachineParams&) = default;
};

// An autoscheduler's name and its parameters as text. parallelism, last_level_cache_size and balance are
// those of MachineParams. Names of Halide's autoschedulers select the built-in one, which says so in a
// warning and ignores their other parameters.
struct AutoschedulerParams {
  std::string name;                          // name of the autoscheduler
  std::map<std::string, std::string> extra;  // parameters by name

  AutoschedulerParams() = default;  // the default autoscheduler
  AutoschedulerParams(const std::string& name, const std::map<std::string, std::string>& extra = {})
      : name(name), extra(extra) {}
  std::string to_string() const;  // autoscheduler=NAME autoscheduler.KEY=VALUE ...
};

// The schedule that an autoscheduler chose.
struct AutoSchedulerResults {
  std::string scheduler_name;          // the autoscheduler that ran
  Target target;                       // the target that it scheduled for
  std::string machine_params_string;   // the MachineParams as text
  std::string schedule_source;         // the schedule as C++
  std::vector<uint8_t> featurization;  // data of the autoscheduler's own
  // Bytes alive at once in a call, inputs and outputs included, and the limit. Set by the built-in
  // autoscheduler. The bytes may exceed the limit if it knows no schedule that takes less. Unknown sizes
  // count as 0.
  int64_t memory_bytes = 0, memory_budget_bytes = 0;
  SearchedSchedules search;                  // set with AutoscheduleOptions::search
  AutoschedulerParams autoscheduler_params;  // set by apply_autoscheduler
};

// A function that schedules the Funcs of a pipeline.
using AutoSchedulerFn =
    std::function<void(const Pipeline& pipeline, const Target& target, const MachineParams& machine,
                       AutoSchedulerResults* results)>;

// Registers an autoscheduler under a name; a null function removes the name.
void add_autoscheduler(const std::string& name, const AutoSchedulerFn& scheduler);
// A function that schedules a pipeline and receives all parameters.
using AutoschedulerParamsFn =
    std::function<void(const Pipeline& pipeline, const Target& target,
                       const AutoschedulerParams& params, AutoSchedulerResults* results)>;
template <typename F>
requires(std::is_invocable_v<F, const Pipeline&, const Target&, const AutoschedulerParams&,
                             AutoSchedulerResults*>) void add_autoscheduler(const std::string& name,
                                                                            const F& scheduler) {
  frontend::add_autoscheduler(name, AutoschedulerParamsFn(scheduler));
}
// Names of all registered autoschedulers.
std::vector<std::string> autoscheduler_names();
// Name of the built-in autoscheduler.
inline constexpr const char* built_in_autoscheduler = "Retrograde";
// Selects the autoscheduler that auto_schedule() without a name uses; "" selects the built-in one.
// Requires: an autoscheduler is loaded from a plugin before it is used.
void set_default_autoscheduler_name(const std::string& name);
// The autoscheduler that auto_schedule() without a name uses.
std::string default_autoscheduler_name();
// The autoscheduler of this name. If there is none, the error lists the registered names.
// Requires: autoschedulers have different names; an autoscheduler is loaded from a plugin before it
// is used.
AutoSchedulerFn find_autoscheduler(const std::string& name);
// Opens a shared library, whose static initialisers register autoschedulers.
// Requires: it is a shared library that can be opened.
void load_plugin(const std::string& library);

}  // namespace retrograde

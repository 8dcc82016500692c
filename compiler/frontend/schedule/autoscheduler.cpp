// autoscheduler.cpp -- the registry of autoschedulers, and auto_schedule() of a pipeline.
#include "frontend/schedule/autoscheduler.h"

#include <dlfcn.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <mutex>
#include <set>

#include "diagnostics/error.h"
#include "frontend/language/func.h"
#include "frontend/run/pipeline.h"
#include "frontend/run/warnings.h"

namespace retrograde {

namespace {

AutoschedulerParamsFn find_with_params(const std::string& name);

struct Loaded {
  std::mutex mutex;
  std::map<std::string, AutoschedulerParamsFn> by_name;
  std::set<std::string> claimed_twice;
  std::string default_name;
};
Loaded& loaded() {
  static Loaded result;
  return result;
}

// Parses one number and the comma after it.
template <typename T>
bool take_number(const char*& at, const char* end, bool last, T& value) {
  const auto [stop, error] = std::from_chars(at, end, value);
  if (error != std::errc() || (last ? stop != end : stop == end || *stop != ',')) return false;
  at = last ? end : stop + 1;
  return true;
}

// "blur" means libblur.so; a name with a slash or a dot is a file name.
std::string library_file(const std::string& library) {
  return library.find_first_of("/.") == std::string::npos ? "lib" + library + ".so" : library;
}

}  // namespace

MachineParams::MachineParams(const std::string& text) {
  const char* at = text.data();
  const char* end = at + text.size();
  if (take_number(at, end, false, parallelism) &&
      take_number(at, end, false, last_level_cache_size) && take_number(at, end, true, balance)) {
    return;
  }
  user_error("read the machine parameters " + quoted(text),
             "they are the threads, the bytes of the last-level cache and the cost of a load",
             "these are not three numbers with commas between them",
             "Write for example 16,16777216,40");
}

std::string MachineParams::to_string() const {
  return text(parallelism, ",", last_level_cache_size, ",", balance);
}

std::string AutoschedulerParams::to_string() const {
  std::string result = name.empty() ? "" : "autoscheduler=" + name;
  for (const auto& [key, value] : extra)
    result += text(result.empty() ? "" : " ", "autoscheduler.", key, "=", value);
  return result;
}

namespace {

const char* const machine_keys[] = {"parallelism", "last_level_cache_size", "balance"};

// Missing parameters have the values of the generic machine.
MachineParams machine_of(const AutoschedulerParams& params) {
  std::string values;
  for (size_t i = 0; i < std::size(machine_keys); i++) {
    const MachineParams generic = MachineParams::generic();
    const std::string defaults[] = {text(generic.parallelism), text(generic.last_level_cache_size),
                                    text(generic.balance)};
    const auto entry = params.extra.find(machine_keys[i]);
    values += (i ? "," : "") + (entry == params.extra.end() ? defaults[i] : entry->second);
  }
  return MachineParams(values);
}

AutoschedulerParams params_of(const std::string& name, const MachineParams& machine) {
  return {name,
          {{machine_keys[0], text(machine.parallelism)},
           {machine_keys[1], text(machine.last_level_cache_size)},
           {machine_keys[2], text(machine.balance)}}};
}

// Parameters that the built-in autoscheduler ignores.
std::string unknown_keys(const AutoschedulerParams& params) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : params.extra) {
    if (std::ranges::find(machine_keys, key) == std::end(machine_keys)) keys.push_back(key);
  }
  return listed(keys, quoted);
}

bool is_of_halide(const std::string& name) {
  return name == "Adams2019" || name == "Anderson2021" || name == "Li2018" ||
         name == "Mullapudi2016";
}

}  // namespace

// Plugins call this from static initialisers, which must not throw; find_autoscheduler reports the error instead.
void frontend::add_autoscheduler(const std::string& name, const AutoschedulerParamsFn& scheduler) {
  std::lock_guard lock(loaded().mutex);
  if (!scheduler) {
    loaded().by_name.erase(name);
    loaded().claimed_twice.erase(name);
  } else if (!loaded().by_name.emplace(name, scheduler).second) {
    loaded().claimed_twice.insert(name);
  }
}

void add_autoscheduler(const std::string& name, const AutoSchedulerFn& scheduler) {
  if (!scheduler) return frontend::add_autoscheduler(name, AutoschedulerParamsFn());
  frontend::add_autoscheduler(
      name, AutoschedulerParamsFn([scheduler](const Pipeline& pipeline, const Target& target,
                                              const AutoschedulerParams& params,
                                              AutoSchedulerResults* results) {
        scheduler(pipeline, target, machine_of(params), results);
      }));
}

std::vector<std::string> autoscheduler_names() {
  std::lock_guard lock(loaded().mutex);
  return ir::keys_of(loaded().by_name);
}

void set_default_autoscheduler_name(const std::string& name) {
  if (!name.empty()) find_autoscheduler(name);
  std::lock_guard lock(loaded().mutex);
  loaded().default_name = name;
}

std::string default_autoscheduler_name() {
  std::lock_guard lock(loaded().mutex);
  return loaded().default_name.empty() ? built_in_autoscheduler : loaded().default_name;
}

AutoSchedulerFn find_autoscheduler(const std::string& name) {
  return [scheduler = find_with_params(name), name](const Pipeline& pipeline, const Target& target,
                                                    const MachineParams& machine,
                                                    AutoSchedulerResults* results) {
    scheduler(pipeline, target, params_of(name, machine), results);
  };
}

namespace {
AutoschedulerParamsFn find_with_params(const std::string& name) {
  const std::string present = listed(autoscheduler_names(), quoted);
  std::lock_guard lock(loaded().mutex);
  if (loaded().claimed_twice.count(name)) {
    user_error("schedule automatically with " + quoted(name), "autoschedulers have different names",
               "two of that name were added",
               "Take one away: add_autoscheduler(name, nullptr), or rename it");
  }
  if (auto found = loaded().by_name.find(name); found != loaded().by_name.end())
    return found->second;
  user_error("schedule automatically with " + quoted(name),
             "an autoscheduler is loaded from a plugin before it is used",
             present.empty() ? "none is loaded" : "loaded are " + present,
             "Load its plugin, or schedule by hand");
}
}  // namespace

void load_plugin(const std::string& library) {
  const std::string file = library_file(library);
  if (dlopen(file.c_str(), RTLD_LAZY)) return;
  const char* reason = dlerror();
  user_error("load the plugin " + quoted(library), "it is a shared library that can be opened",
             reason ? reason : "it cannot", "Give its path");
}

// ---- auto_schedule ----

// The copy of the pipeline shares the Funcs but has options of its own.
AutoSchedulerResults Pipeline::auto_schedule(const Target& target,
                                             const AutoscheduleOptions& options,
                                             const MachineParams& machine) const {
  Pipeline with_options(outputs());
  with_options.set_autoschedule(options);
  return with_options.auto_schedule(built_in_autoscheduler, target, machine);
}

AutoSchedulerResults Pipeline::auto_schedule(const std::string& name, const Target& target,
                                             const MachineParams& machine) const {
  const AutoSchedulerFn scheduler = find_autoscheduler(name);
  AutoSchedulerResults results;
  results.scheduler_name = name;
  results.target = target;
  results.machine_params_string = machine.to_string();
  scheduler(*this, target, machine, &results);
  return results;
}

std::string frontend::scheduler_for(const AutoschedulerParams& params) {
  const std::string& asked = params.name;
  if (asked.empty()) return default_autoscheduler_name();
  const auto present = autoscheduler_names();
  if (!is_of_halide(asked) || std::ranges::find(present, asked) != present.end()) {
    if (asked != built_in_autoscheduler || unknown_keys(params).empty()) return asked;
    user_error(
        "schedule automatically with " + params.to_string(),
        "the built-in autoscheduler takes parameters of the machine",
        "it knows parallelism, last_level_cache_size and balance, not " + unknown_keys(params),
        "Leave them out, or give AutoscheduleOptions");
  }
  std::string ignored = unknown_keys(params);
  if (!ignored.empty()) ignored = "; it has no use for " + ignored;
  tell_warning("the autoscheduler " + quoted(asked) +
               " is not here: " + quoted(built_in_autoscheduler) + " schedules instead" + ignored +
               ". Name that one.");
  return built_in_autoscheduler;
}

AutoSchedulerResults Pipeline::apply_autoscheduler(const Target& target,
                                                   const AutoschedulerParams& params) const {
  const std::string name = frontend::scheduler_for(params);
  AutoSchedulerResults results;
  results.scheduler_name = name;
  results.target = target;
  results.autoscheduler_params = params;
  results.machine_params_string = machine_of(params).to_string();
  find_with_params(name)(*this, target, params, &results);
  return results;
}

AutoSchedulerResults Pipeline::auto_schedule(const Target& target,
                                             const MachineParams& machine) const {
  return auto_schedule(default_autoscheduler_name(), target, machine);
}

}  // namespace retrograde

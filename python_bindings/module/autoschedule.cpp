// autoschedule.cpp -- binds auto_schedule, its options and results, and Python autoschedulers.
#include "bind_all.h"
#include "binding.h"
#include "callback.h"
#include "driver/schedule.h"
#include "func_class.h"
#include "runnable.h"

namespace retrograde::python {

namespace {

using py::arg;

std::optional<FuncName> func_name_from(py::handle object) {
  if (py::isinstance<Func>(object)) return FuncName(object.cast<const Func&>());
  if (py::isinstance<py::str>(object)) return FuncName(object.cast<std::string>());
  return {};
}

std::vector<FuncName> func_names(const py::iterable& objects) {
  std::vector<FuncName> names;
  for (py::handle one : objects) {
    const std::optional<FuncName> name = func_name_from(one);
    if (!name) throw py::type_error("a Func, or the name of one");
    names.push_back(*name);
  }
  return names;
}

std::vector<std::string> texts(const std::vector<FuncName>& names) {
  std::vector<std::string> result;
  for (const FuncName& name : names) result.push_back(name.name);
  return result;
}

void bind_options(py::module_& m) {
  py::enum_<Decision> decision(m, "Decision", documentation("Decision"));
  for (const Decision d : all_decisions()) decision.value(to_string(d).c_str(), d);
  def(m, "all_decisions", &all_decisions);
  using Options = AutoscheduleOptions;
  Class<Options>(m, "AutoscheduleOptions")
      .def(py::init([](const std::vector<Decision>& without, const py::iterable& store,
                       const py::iterable& inlined, int threads, int64_t memory_budget, bool search,
                       bool deterministic) {
             return Options{{without.begin(), without.end()},
                            func_names(store),
                            func_names(inlined),
                            threads,
                            memory_budget,
                            search,
                            deterministic};
           }),
           py::kw_only(), arg("without") = std::vector<Decision>(), arg("store") = py::list(),
           arg("inlined") = py::list(), arg("threads") = 0, arg("memory_budget") = 0,
           arg("search") = false, arg("deterministic") = true)
      .def_readwrite("without", &Options::without)
      .def_property(
          "store", [](const Options& o) { return texts(o.store); },
          [](Options& o, const py::iterable& names) { o.store = func_names(names); })
      .def_property(
          "inlined", [](const Options& o) { return texts(o.inlined); },
          [](Options& o, const py::iterable& names) { o.inlined = func_names(names); })
      .def_readwrite("threads", &Options::threads)
      .def_readwrite("memory_budget", &Options::memory_budget)
      .def_readwrite("search", &Options::search)
      .def_readwrite("deterministic", &Options::deterministic)
      .def("to_string", &Options::to_string)
      .def_static("from_string", &Options::from_string, arg("text"))
      .def("__str__", &Options::to_string)
      .def(
          "__eq__", [](const Options& a, const Options& b) { return a == b; }, py::is_operator());
}

void bind_machine(py::module_& m) {
  Class<MachineParams>(m, "MachineParams")
      .def(py::init<>())
      .def(py::init<int, uint64_t, float>(), arg("parallelism"), arg("last_level_cache_size"),
           arg("balance"))
      .def(py::init<const std::string&>(), arg("text"))
      .def_static("generic", &MachineParams::generic)
      .def_readwrite("parallelism", &MachineParams::parallelism)
      .def_readwrite("last_level_cache_size", &MachineParams::last_level_cache_size)
      .def_readwrite("balance", &MachineParams::balance)
      .def("to_string", &MachineParams::to_string)
      .def("__str__", &MachineParams::to_string)
      .def(
          "__eq__", [](const MachineParams& a, const MachineParams& b) { return a == b; },
          py::is_operator());
}

void bind_results(py::module_& m) {
  Class<SearchedSchedules>(m, "SearchedSchedules")
      .def_readonly("tried", &SearchedSchedules::tried)
      .def_readonly("default_ms", &SearchedSchedules::default_ms)
      .def_readonly("predicted_ms", &SearchedSchedules::predicted_ms)
      .def_readonly("runner_up_ms", &SearchedSchedules::runner_up_ms)
      .def_readonly("runner_up", &SearchedSchedules::runner_up)
      .def_readonly("note", &SearchedSchedules::note)
      .def("to_string", &SearchedSchedules::to_string)
      .def("__str__", &SearchedSchedules::to_string);
  using Results = AutoSchedulerResults;
  // Autoschedulers in Python write these results too.
  Class<Results>(m, "AutoSchedulerResults")
      .def_readwrite("scheduler_name", &Results::scheduler_name)
      .def_readwrite("target", &Results::target)
      .def_readwrite("machine_params_string", &Results::machine_params_string)
      .def_readwrite("schedule_source", &Results::schedule_source)
      .def_readwrite("featurization", &Results::featurization)
      .def_readwrite("memory_bytes", &Results::memory_bytes)
      .def_readwrite("memory_budget_bytes", &Results::memory_budget_bytes)
      .def_readonly("search", &Results::search);
}

AutoSchedulerFn scheduler_of(const std::optional<py::function>& function) {
  if (!function) return nullptr;
  return [callback = Callback(*function)](const Pipeline& pipeline, const Target& target,
                                          const MachineParams& machine,
                                          AutoSchedulerResults* results) {
    const py::gil_scoped_acquire acquire;
    // The results object of this call, which the autoscheduler writes into.
    callback.call<void>(pipeline, target, machine,
                        py::cast(results, py::return_value_policy::reference));
  };
}

void bind_schedulers(py::module_& m) {
  def(
      m, "add_autoscheduler",
      [](const std::string& name, const std::optional<py::function>& scheduler) {
        add_autoscheduler(name, scheduler_of(scheduler));
      },
      arg("name"), arg("scheduler"));
  def(m, "autoscheduler_names", &autoscheduler_names);
  def(m, "set_default_autoscheduler_name", &set_default_autoscheduler_name, arg("name"));
  def(m, "default_autoscheduler_name", &default_autoscheduler_name);
  def(m, "load_plugin", &load_plugin, arg("library"));
  m.attr("built_in_autoscheduler") = built_in_autoscheduler;
  // Python functions must not outlive the interpreter, so their registrations end at exit.
  py::module_::import("atexit").attr("register")(py::cpp_function([m] {
    for (const std::string& name : autoscheduler_names()) {
      if (name != built_in_autoscheduler) add_autoscheduler(name, nullptr);
    }
  }));
}

// Values may be numbers, which become text.
void bind_params(py::module_& m) {
  Class<AutoschedulerParams>(m, "AutoschedulerParams")
      .def(py::init([](const std::string& name, const py::dict& extra) {
             AutoschedulerParams params(name);
             for (const auto& [key, value] : extra)
               params.extra[std::string(py::str(key))] = std::string(py::str(value));
             return params;
           }),
           arg("name") = "", arg("extra") = py::dict())
      .def_readwrite("name", &AutoschedulerParams::name)
      .def_readwrite("extra", &AutoschedulerParams::extra)
      .def("to_string", &AutoschedulerParams::to_string)
      .def("__repr__", [](const AutoschedulerParams& params) {
        return "<retrograde.AutoschedulerParams " + params.to_string() + ">";
      });
}

void bind_scheduling(py::module_& m) {
  Class<Pipeline> c = reopened<Pipeline>(m, "Pipeline", {"Runnable"});
  c.def(
       "auto_schedule",
       [](const Pipeline& p, const Target& target, const MachineParams& machine) {
         return unlocked([=](const Interruption&) { return p.auto_schedule(target, machine); });
       },
       arg("target"), arg("machine_params") = MachineParams())
      .def(
          "auto_schedule",
          [](const Pipeline& p, const Target& target, const AutoscheduleOptions& options,
             const MachineParams& machine) {
            return unlocked(
                [=](const Interruption&) { return p.auto_schedule(target, options, machine); });
          },
          arg("target"), arg("options"), arg("machine_params") = MachineParams())
      .def(
          "auto_schedule",
          [](const Pipeline& p, const std::string& name, const Target& target,
             const MachineParams& machine) {
            return unlocked(
                [=](const Interruption&) { return p.auto_schedule(name, target, machine); });
          },
          arg("name"), arg("target"), arg("machine_params") = MachineParams())
      .def(
          "apply_autoscheduler",
          [](const Pipeline& p, const Target& target, const AutoschedulerParams& params) {
            return unlocked(
                [=](const Interruption&) { return p.apply_autoscheduler(target, params); });
          },
          arg("target"), arg("params"))
      .def(
          "_scheduled_copy",
          [](const Pipeline& p, const Target& target) {
            return unlocked([=](const Interruption&) { return driver::scheduled_copy(p, target); });
          },
          arg("target"))
      .def("set_autoschedule", &Pipeline::set_autoschedule, arg("options"))
      .def_static(
          "add_autoscheduler",
          [](const std::string& name, const std::optional<py::function>& scheduler) {
            add_autoscheduler(name, scheduler_of(scheduler));
          },
          arg("name"), arg("scheduler"))
      .def_static("set_default_autoscheduler_name", &set_default_autoscheduler_name, arg("name"));
  reopened<Func>(m, "Func", {"Runnable"})
      .def("set_autoschedule", &Func::set_autoschedule, arg("options"));
}

}  // namespace

void bind_autoschedule(py::module_& m) {
  bind_options(m);
  bind_machine(m);
  bind_results(m);
  bind_schedulers(m);
  bind_params(m);
  bind_scheduling(m);
}

}  // namespace retrograde::python

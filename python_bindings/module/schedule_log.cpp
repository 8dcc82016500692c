// schedule_log.cpp -- binds ScheduleLog and the reports of schedules' costs.
#include "bind_all.h"
#include "binding.h"
#include "driver/reports.h"
#include "frontend/run/kernel_report.h"
#include "func_class.h"
#include "runnable.h"

namespace retrograde::python {

namespace {

using py::arg;

void bind_log(py::module_& m) {
  Class<ScheduleLog>(m, "ScheduleLog")
      .def(py::init<>())
      .def_static("parse", &ScheduleLog::parse, arg("text"))
      .def("to_text", &ScheduleLog::to_text)
      .def("to_cpp", &ScheduleLog::to_cpp)
      .def("size", &ScheduleLog::size)
      .def("first", &ScheduleLog::first, arg("count"))
      .def("of", &ScheduleLog::of, arg("func"))
      .def("without", &ScheduleLog::without, arg("index"))
      .def("__len__", &ScheduleLog::size)
      .def("__str__", &ScheduleLog::to_text)
      .def(
          "__eq__", [](const ScheduleLog& a, const ScheduleLog& b) { return a == b; },
          py::is_operator());
}

void bind_report(py::module_& m) {
  Class<ExplainOptions>(m, "ExplainOptions")
      .def(py::init([](bool measure, double seconds, int threads, bool runner_up) {
             return ExplainOptions{measure, seconds, threads, runner_up};
           }),
           py::kw_only(), arg("measure") = false, arg("seconds") = 2.0, arg("threads") = 0,
           arg("runner_up") = false)
      .def_readwrite("measure", &ExplainOptions::measure)
      .def_readwrite("seconds", &ExplainOptions::seconds)
      .def_readwrite("threads", &ExplainOptions::threads)
      .def_readwrite("runner_up", &ExplainOptions::runner_up);
  Class<ScheduleReport> report(m, "ScheduleReport");
  using Stage = ScheduleReport::Stage;
  Class<Stage>(report, "Stage", {"ScheduleReport::Stage"})
      .def_readonly("name", &Stage::name)
      .def_readonly("predicted_ms", &Stage::predicted_ms)
      .def_readonly("bound_by", &Stage::bound_by)
      .def_readonly("bytes", &Stage::bytes)
      .def_readonly("memory_bytes", &Stage::memory_bytes)
      .def_readonly("measured_ms", &Stage::measured_ms);
  report.def_readonly("schedule", &ScheduleReport::schedule)
      .def_readonly("machine", &ScheduleReport::machine)
      .def_readonly("stages", &ScheduleReport::stages)
      .def_readonly("predicted_ms", &ScheduleReport::predicted_ms)
      .def_readonly("first_call_ms", &ScheduleReport::first_call_ms)
      .def_readonly("measured_ms", &ScheduleReport::measured_ms)
      .def_readonly("search", &ScheduleReport::search)
      .def_readonly("kernels", &ScheduleReport::kernels)
      .def("to_string", &ScheduleReport::to_string)
      .def("to_json", &ScheduleReport::to_json)
      .def("__str__", &ScheduleReport::to_string);
}

void bind_kernel_report(py::module_& m) {
  Class<KernelReport> report(m, "KernelReport");
  using Kernel = KernelReport::Kernel;
  Class<Kernel>(report, "Kernel", {"KernelReport::Kernel"})
      .def_readonly("name", &Kernel::name)
      .def_readonly("loops", &Kernel::loops)
      .def_readonly("threads", &Kernel::threads)
      .def_readonly("shared_bytes", &Kernel::shared_bytes)
      .def_readonly("local_bytes", &Kernel::local_bytes)
      .def_readonly("registers", &Kernel::registers)
      .def_readonly("stack_bytes", &Kernel::stack_bytes)
      .def_readonly("spill_bytes", &Kernel::spill_bytes);
  report.def_readonly("kernels", &KernelReport::kernels)
      .def_readonly("assembler", &KernelReport::assembler)
      .def_readonly("notes", &KernelReport::notes)
      .def("to_string", &KernelReport::to_string)
      .def("to_json", &KernelReport::to_json)
      .def("__str__", &KernelReport::to_string);
}

// The facts that _explain.py writes as text.
py::dict as_dict(const tuning::ExplainedPipeline& explained) {
  py::list stages, stored;
  for (const tuning::ExplainedStage& stage : explained.stages) {
    stages.append(py::dict(py::arg("name") = stage.name, py::arg("ms") = stage.ms,
                           py::arg("bound") = stage.bound, py::arg("loops") = stage.loops,
                           py::arg("hints") = stage.hints));
  }
  for (const tuning::StoredFunc& f : explained.stored)
    stored.append(py::make_tuple(f.name, f.bytes));
  return py::dict(py::arg("machine") = explained.machine, py::arg("threads") = explained.threads,
                  py::arg("ms") = explained.ms, py::arg("stages") = stages,
                  py::arg("stored") = stored, py::arg("recomputed") = explained.recomputed);
}

ScheduleReport explained(const Pipeline& pipeline, const Target& target, const py::object& outputs,
                         const ExplainOptions& options) {
  const Outputs to = outputs_from(outputs, "explain the schedule");
  if (to.are_buffers()) allow_strides(pipeline.outputs(), to.buffers);
  return unlocked([=](const Interruption&) {
    if (!to.are_buffers()) return pipeline.explain_schedule(target, to.sizes, options);
    return pipeline.explain_schedule(RealizationArg(to.buffers), target, options);
  });
}

}  // namespace

void bind_schedule_log(py::module_& m) {
  bind_log(m);
  bind_kernel_report(m);
  bind_report(m);
  def(
      m, "explain_kernels",
      [](const Pipeline& pipeline, const Target& target) {
        return unlocked([=](const Interruption&) { return explain_kernels(pipeline, target); });
      },
      arg("pipeline"), arg("target"));
  m.def(
      "_explain_stages",
      [](const Pipeline& pipeline, const Target& target, const std::vector<std::vector<int>>& sizes,
         const std::map<std::string, std::vector<int>>& input_sizes) {
        return as_dict(unlocked([=](const Interruption&) {
          return driver::explain_stages(pipeline.spec(), target, sizes, input_sizes);
        }));
      },
      arg("pipeline"), arg("target"), arg("output_sizes"), arg("input_sizes"));
  reopened<Func>(m, "Func", {"Pipeline"})
      .def(
          "explain_schedule",
          [](const Func& f, const Target& target, const py::object& outputs,
             const ExplainOptions& options) {
            return explained(Pipeline(f), target, outputs, options);
          },
          arg("target") = Target(), arg("outputs") = py::list(), arg("options") = ExplainOptions());
  reopened<Pipeline>(m, "Pipeline", {})
      .def("schedule_log", &Pipeline::schedule_log)
      .def("apply_schedule", &Pipeline::apply_schedule, arg("log"))
      .def("explain_schedule", &explained, arg("target") = Target(), arg("outputs") = py::list(),
           arg("options") = ExplainOptions());
}

}  // namespace retrograde::python

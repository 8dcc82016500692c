#include "driver/schedule.h"

#include <algorithm>

#include "autoschedule/default_schedule.h"
#include "autoschedule/graph_rewrites.h"
#include "autoschedule/keep_graph.h"
#include "autoschedule/machine/kept_machine.h"
#include "autoschedule/stored_funcs.h"
#include "autoschedule/task_sizes.h"
#include "diagnostics/large_stack.h"
#include "frontend/language/func.h"
#include "graph/copy_graph.h"
#include "graph/definitions/first_reads.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/schedule_log.h"
#include "graph/directives/wrappers.h"
#include "lower/lower.h"
#include "tuning/predict.h"

namespace retrograde::driver {

using autoschedule::ScheduleRequest;
using autoschedule::Scheduling;

namespace {

// As after auto_schedule(): nothing is left to decide.
bool is_scheduled(const std::vector<FuncPtr>& outputs) {
  return std::ranges::all_of(topological_order(outputs),
                             [](const FuncPtr& f) { return has_directives(*f); });
}

// `searches`: by `cost`.
ChosenSchedule schedule_graph(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request,
                              const Target& target, bool wants_runner_up) {
  const bool searches = request.options.search || wants_runner_up;
  const std::vector<FuncPtr> wrapped = apply_wrappers(outputs);
  ChosenSchedule result;
  if (!autoschedule::is_differentiated(wrapped)) {
    result.graph.outputs = autoschedule::with_large_funcs_at_root(wrapped, request);
    if (searches) {
      result.search.note = note_against_search(wrapped, "compiling searches schedules of gradients",
                                               "none of its Funcs is one",
                                               "Call auto_schedule() with these options");
    }
    return result;
  }
  result.graph.outputs = autoschedule::with_graph_rewrites(wrapped, /*on_gpu=*/false);
  if (!searches && is_scheduled(result.graph.outputs)) return result;
  return choose_schedule(result.graph.outputs, request, Scheduling::Gradients, target,
                         wants_runner_up);
}

}  // namespace

ChosenSchedule schedule(const PipelineSpec& pipeline, const Target& target, bool wants_runner_up) {
  const ScheduleRequest request = autoschedule::request_for(target, pipeline.autoschedule);
  autoschedule::keep_graph(pipeline.name, pipeline.outputs);
  ChosenSchedule result;
  run_on_large_stack([&] {
    const graph::FirstReadsMemo memo;
    result = schedule_graph(pipeline.outputs, request, target, wants_runner_up);
  });
  return result;
}

std::vector<FuncPtr> schedule_unscheduled(const std::vector<FuncPtr>& outputs,
                                          const planning::Machine& machine,
                                          const AutoscheduleOptions& options) {
  ScheduleRequest request{machine, options};
  request.options.search = false;
  std::vector<FuncPtr> result;
  run_on_large_stack([&] {
    const graph::FirstReadsMemo memo;
    result = schedule_graph(outputs, request, Target(), /*wants_runner_up=*/false).graph.outputs;
  });
  return result;
}

Pipeline scheduled_copy(const Pipeline& pipeline, const Target& target) {
  const PipelineSpec spec = pipeline.spec();
  std::vector<FuncPtr> funcs = apply_wrappers(spec.outputs);
  const bool schedules = target.has_gpu_feature() || graph::schedule_log(funcs).size() == 0;
  if (schedules) {
    funcs = autoschedule::with_graph_rewrites(funcs, target.has_gpu_feature(),
                                              autoschedule::SumOrder::Free);
  }
  funcs = copy_graph(funcs).outputs;
  Pipeline copy(std::vector<Func>(funcs.begin(), funcs.end()));
  copy.set_autoschedule(spec.autoschedule);
  if (schedules) copy.auto_schedule(target);
  return copy;
}

double predicted_seconds(const std::vector<FuncPtr>& scheduled, const Target& target, int threads) {
  lower::LowerOptions lowering;
  lowering.target = target;
  const ir::LoweredFunction function =
      lower::lower("searched", scheduled, lower::infer_arguments(scheduled), lowering);
  return tuning::predicted_seconds(
      function, tuning::program_sizes(function, tuning::output_shapes(scheduled)),
      planning::machine_for(target), threads);
}

}  // namespace retrograde::driver

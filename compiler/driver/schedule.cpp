#include "driver/schedule.h"

#include <algorithm>

#include "diagnostics/large_stack.h"
#include "driver/keep_graph.h"
#include "driver/plan_search.h"
#include "frontend/language/func.h"
#include "graph/copy_graph.h"
#include "graph/definitions/first_reads.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/schedule_log.h"
#include "graph/directives/wrappers.h"
#include "transform/graph_rewrites.h"
#include "transform/large_bodies.h"

namespace retrograde::driver {

namespace {

// As after auto_schedule(): nothing is left to decide.
bool is_scheduled(const std::vector<FuncPtr>& outputs) {
  return std::ranges::all_of(topological_order(outputs),
                             [](const FuncPtr& f) { return has_directives(*f); });
}

ChosenSchedule schedule_graph(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request,
                              const Lowering& lowering, Choosing choosing) {
  const bool is_searched = request.options.search || choosing == Choosing::ScheduleAndRunnerUp;
  const std::vector<FuncPtr> wrapped = apply_wrappers(outputs);
  ChosenSchedule result;
  if (!transform::is_differentiated(wrapped)) {
    const std::vector<FuncPtr> large = transform::large_bodies(wrapped, {});
    result.graph.outputs = large.empty() ? wrapped : stored_along_rows(wrapped, large);
    if (is_searched) {
      result.search.note = note_against_search(wrapped, "compiling searches schedules of gradients",
                                               "none of its Funcs is one",
                                               "Call auto_schedule() with these options");
    }
    return result;
  }
  result.graph.outputs = transform::with_graph_rewrites(wrapped, /*on_gpu=*/false);
  if (!is_searched && is_scheduled(result.graph.outputs)) return result;
  return choose_schedule(result.graph.outputs, request, Scheduling::Gradients, lowering, choosing);
}

}  // namespace

ChosenSchedule schedule(const PipelineSpec& pipeline, const Lowering& lowering, Choosing choosing) {
  const ScheduleRequest request = request_for(lowering.target, pipeline.autoschedule);
  keep_graph(pipeline.name, pipeline.outputs);
  ChosenSchedule result;
  run_on_large_stack([&] {
    const graph::FirstReadsMemo memo;
    result = schedule_graph(pipeline.outputs, request, lowering, choosing);
  });
  return result;
}

ir::LoweredFunction schedule_and_lower(const PipelineSpec& pipeline, const Lowering& lowering) {
  ChosenSchedule chosen = schedule(pipeline, lowering);
  return chosen.lowered ? std::move(*chosen.lowered) : lowering.lower(chosen.graph.outputs);
}

std::vector<FuncPtr> schedule_unscheduled(const std::vector<FuncPtr>& outputs,
                                          const ScheduleRequest& request) {
  std::vector<FuncPtr> result;
  run_on_large_stack([&] {
    const graph::FirstReadsMemo memo;
    result = schedule_graph(outputs, request, Lowering(), Choosing::Schedule).graph.outputs;
  });
  return result;
}

Pipeline scheduled_copy(const Pipeline& pipeline, const Target& target) {
  const PipelineSpec spec = pipeline.spec();
  std::vector<FuncPtr> funcs = apply_wrappers(spec.outputs);
  const bool schedules = target.has_gpu_feature() || graph::schedule_log(funcs).size() == 0;
  if (schedules) {
    funcs =
        transform::with_graph_rewrites(funcs, target.has_gpu_feature(), transform::SumOrder::Free);
  }
  funcs = copy_graph(funcs).outputs;
  Pipeline copy(std::vector<Func>(funcs.begin(), funcs.end()));
  copy.set_autoschedule(spec.autoschedule);
  if (schedules) copy.auto_schedule(target);
  return copy;
}

}  // namespace retrograde::driver

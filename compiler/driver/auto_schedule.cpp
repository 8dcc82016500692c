// auto_schedule.cpp -- the scheduler of Pipeline::auto_schedule() where no plugin was asked for.
//
// It gives a schedule (choose_schedule.h) to a copy of the graph. The directives that the log of the copy has beyond
// that of the pipeline are then given to the pipeline, and are the source.
#include "diagnostics/large_stack.h"
#include "driver/keep_graph.h"
#include "driver/schedule.h"
#include "frontend/run/pipeline.h"
#include "frontend/schedule/autoscheduler.h"
#include "graph/definitions/first_reads.h"
#include "graph/directives/schedule_log.h"
#include "graph/directives/wrappers.h"

namespace retrograde::driver {

namespace {

// Code that reports each load, store, region or broken promise runs on the host.
bool is_for_gpu(const Target& target) {
  return target.has_feature(Target::CUDA) &&
         !target.features_any_of({Target::TraceLoads, Target::TraceStores,
                                  Target::TraceRealizations, Target::CheckUnsafePromises});
}

void schedule_all(const Pipeline& pipeline, const Target& target, const MachineParams& machine,
                  AutoSchedulerResults* results) {
  const PipelineSpec spec = pipeline.spec();
  const std::vector<FuncPtr>& outputs = spec.outputs;
  run_on_large_stack([&] {
    const FirstReadsMemo memo;
    keep_graph(spec.name, outputs);
    const std::vector<FuncPtr> wrapped = apply_wrappers(outputs);
    const auto given = static_cast<std::ptrdiff_t>(schedule_log(wrapped).size());
    ScheduleRequest request = request_for(target, spec.autoschedule, machine);
    request.on_gpu = is_for_gpu(target);
    ChosenSchedule chosen = choose_schedule(wrapped, request, Scheduling::Everything, {target});
    const ScheduledGraph& scheduled = chosen.graph;
    ScheduleLog log = schedule_log(scheduled.outputs);
    log.entries.erase(log.entries.begin(), log.entries.begin() + given);
    apply_log(log, outputs);
    results->schedule_source = log.to_cpp();
    results->memory_bytes = scheduled.memory.bytes;
    results->memory_budget_bytes = scheduled.memory.budget_bytes;
    results->search = std::move(chosen.search);
  });
}

[[maybe_unused]] const bool is_added = [] {
  add_autoscheduler(built_in_autoscheduler, schedule_all);
  return true;
}();

}  // namespace

}  // namespace retrograde::driver

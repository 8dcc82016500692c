#include "autoschedule/task_sizes.h"

#include <algorithm>

#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"

namespace retrograde::autoschedule {

namespace {

// All but the first of them, from the outermost on.
void keep_parallel(const FuncPtr& f, int stage, int kept) {
  const std::vector<Dim> loops = f->stage(stage).schedule.dims;
  for (auto loop = loops.rbegin(); loop != loops.rend(); ++loop) {
    if (loop->runs == ForType::Parallel && kept-- <= 0)
      Stage(f, stage).serial(VarOrRVar(loop->var, loop->is_reduction));
  }
}

}  // namespace

int threads_of(const ScheduleRequest& request) { return std::max(request.options.threads, 0); }

TaskSizes::TaskSizes(const std::vector<FuncPtr>& order) {
  for (const FuncPtr& f : order) {
    if (has_directives(*f)) touched_.insert(f.get());
  }
}

void TaskSizes::limit(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request) const {
  const bool is_one_thread = threads_of(request) == 1;
  if (!is_one_thread && request.makes(Decision::TaskSizes)) return;
  for (const FuncPtr& f : topological_order(outputs)) {
    if (touched_.contains(f.get()) || f->is_extern()) continue;
    for (int s = 0; s < f->stage_count(); ++s) keep_parallel(f, s, is_one_thread ? 0 : 1);
  }
}

}  // namespace retrograde::autoschedule

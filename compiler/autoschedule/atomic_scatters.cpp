#include "autoschedule/atomic_scatters.h"

#include <algorithm>

#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/only_reader.h"
#include "autoschedule/scatter_schedule.h"
#include "autoschedule/task_sizes.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"

namespace retrograde::autoschedule {

namespace {

constexpr int vectors_of_a_task = 256;  // along a loop that is cut into tasks
// The elements and the additions of a sum to which threads may add at once.
constexpr int64_t least_elements = planning::uncontended_lines * planning::line_elements;
constexpr double least_adds = planning::launch_operations / planning::atomic_add_operations;

// The first definition: rows in vectors.
void schedule_rows(const FuncPtr& f) {
  Stage rows(f, 0);
  if (f->args.size() > 1) rows.parallel(Var(f->args.back()));
  vectorize(rows, Var(f->args[0]), planning::schedule_lanes, TailStrategy::GuardWithIf);
}

// Each part is added as soon as it is full, its elements in vectors.
void add_parts(const FuncPtr& sum, const FuncPtr& parts) {
  const RVar part(sum->updates[0].rvars[0].var);
  std::vector<VarOrRVar> order;
  for (const std::string& arg : sum->args) order.emplace_back(Var(arg));
  schedule_rows(sum);
  order.emplace_back(part);
  Stage update(sum, 1);
  update.reorder(order).atomic().parallel(part);
  vectorize(update, Var(sum->args[0]), planning::schedule_lanes, TailStrategy::GuardWithIf);
  Func(parts).compute_at(Func(sum), part);
}

// Vectors of iterations, of which each lane adds by itself.
void add_at_places(const FuncPtr& f, int index) {
  Stage stage(f, index);
  const std::vector<VarOrRVar> loops = loops_but_taps(f->stage(index)),
                               taps = loops_of_taps(f->stage(index));
  std::vector<VarOrRVar> order;
  const RVar all(loops[0].name()), lane(inner_loop(*f, index, all.name()));
  RVar tasks(loops.back().name());
  stage.atomic().split(all, all, lane, planning::schedule_lanes, TailStrategy::GuardWithIf);
  order.emplace_back(lane);
  order.insert(order.end(), taps.begin(), taps.end());
  order.insert(order.end(), loops.begin(), loops.end());
  if (loops.size() == 1) {
    tasks = RVar(new_loop(*f, index, "tasks"));
    stage.split(all, tasks, all, vectors_of_a_task, TailStrategy::GuardWithIf);
    order.emplace_back(tasks);
  }
  stage.reorder(order).vectorize(lane).parallel(tasks);
  for (const VarOrRVar& tap : taps) stage.unroll(tap);
}

}  // namespace

AtomicScatters::AtomicScatters(const std::vector<FuncPtr>& outputs,
                               const std::vector<FuncPtr>& stored,
                               const std::unordered_set<const Symbol*>& but,
                               const ScheduleRequest& request, const SizeEstimate& sizes)
    : is_on_(!request.options.deterministic && threads_of(request) != 1 &&
             request.makes(Decision::ScatterStrategy)),
      sizes_(sizes) {
  if (!is_on_ || !request.atomic_parts) return;
  const Readers readers(outputs, stored);
  const auto is_free = [&](const FuncPtr& f) {
    return !has_directives(*f) && !but.contains(f.get());
  };
  for (const FuncPtr& sum : stored) {
    if (!is_free(sum) || sum->is_extern() || sum->updates.size() != 1 || sum->args.empty())
      continue;
    const FuncPtr parts = parts_of_sum(*sum, sum->updates[0]);
    if (!parts || !is_free(parts) || sizes.bytes(*parts) <= sizes.machine().last_cache_bytes())
      continue;
    const auto reader = readers.only_reader(parts);
    if (!reader || reader->func != sum || reader->stage != 1) continue;
    parts_.insert(parts.get());
    parts_of_[sum.get()] = parts;
  }
}

bool AtomicScatters::is_large_scatter(const FuncContents& f, const Definition& update) const {
  if (!is_scatter(f, update) || f.types.size() != 1 || loops_but_taps(update).empty()) return false;
  int64_t elements = 1, adds = 1;
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (is_pure_position(f, update, d)) return false;  // whose values are tasks
    elements *= sizes_.extent(f, d).value_or(0);
  }
  for (const ReductionVariable& r : update.rvars)
    adds *= std::max<int64_t>(as_const_int(r.extent).value_or(1), 1);
  return elements >= least_elements && adds >= least_adds;
}

bool AtomicScatters::schedule(const FuncPtr& f) const {
  if (!is_on_) return false;
  if (const auto found = parts_of_.find(f.get()); found != parts_of_.end()) {
    add_parts(f, found->second);
    return true;
  }
  const bool is_large = !f->updates.empty() && std::ranges::all_of(f->updates, [&](const auto& u) {
    return is_large_scatter(*f, u);
  });
  if (!is_large) return false;
  schedule_rows(f);
  for (int s = 1; s < f->stage_count(); ++s) add_at_places(f, s);
  return true;
}

}  // namespace retrograde::autoschedule

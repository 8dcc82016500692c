#include "autoschedule/plan/readers.h"

#include <algorithm>
#include <unordered_map>

#include "autoschedule/plan/loop_names.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::planning {

namespace {

// The names of a stage's loops, outermost first.
std::vector<std::string> names_of(const Plan& plan, StageId stage) {
  const graph::FuncContents& f = *plan.program->funcs[static_cast<size_t>(stage.func)];
  if (plan.of(stage.func).opacity == Opacity::None)
    return loop_names(f, stage.stage, plan.nest(stage)).loops;
  std::vector<std::string> names =
      mapped(f.stage(stage.stage).schedule.dims, [](const graph::Dim& dim) { return dim.var; });
  std::ranges::reverse(names);
  return names;
}

// The loops that the stage shares with another one; null: none.
const LoopRef* shared_with(const Plan& plan, StageId stage) {
  if (plan.of(stage.func).opacity != Opacity::None) return nullptr;
  const std::optional<LoopRef>& shared = plan.nest(stage).shared_with;
  return shared ? &*shared : nullptr;
}

}  // namespace

StageId owner_of(const Plan& plan, const LoopRef& loop) {
  const LoopRef* shared = shared_with(plan, loop.stage);
  return shared && loop.depth <= shared->depth ? owner_of(plan, {shared->stage, loop.depth})
                                               : loop.stage;
}

std::optional<int> depth_in(const Plan& plan, StageId stage, const Level& level) {
  const StageId host = level.loop.stage;
  if (stage == host || level.loop.depth == around_all_loops || stage == owner_of(plan, level.loop))
    return level.loop.depth;
  if (const LoopRef* shared = shared_with(plan, stage)) {
    const auto depth = depth_in(plan, shared->stage, level);
    if (depth && *depth <= shared->depth) return depth;
  }
  if (stage.func != host.func || !level.in_each_stage) return std::nullopt;
  const std::vector<std::string> own = names_of(plan, stage), wanted = names_of(plan, host);
  const auto found = std::ranges::find(own, wanted[static_cast<size_t>(level.loop.depth)]);
  if (found == own.end()) return std::nullopt;
  return static_cast<int>(found - own.begin());
}

std::vector<std::vector<StageId>> readers_of(const std::vector<graph::FuncPtr>& funcs) {
  std::unordered_map<const graph::FuncContents*, size_t> ids;
  for (const graph::FuncPtr& f : funcs) ids.emplace(f.get(), ids.size());
  std::vector<std::vector<StageId>> readers(funcs.size());
  for (size_t id = 0; id < funcs.size(); ++id) {
    const graph::FuncContents& f = *funcs[id];
    const auto note = [&](const graph::FuncContents* callee, int stage) {
      std::vector<StageId>& list = readers[ids.at(callee)];
      const StageId reader{static_cast<FuncId>(id), static_cast<int16_t>(stage)};
      if (callee != &f && (list.empty() || list.back() != reader)) list.push_back(reader);
    };
    for (int s = 0; s < f.stage_count(); ++s) {
      walk(f.stage(s), [&](const Call& call) {
        if (call.call_type == CallType::Func) note(graph::func_of(call).get(), s);
      });
    }
    if (!f.is_extern()) continue;
    for (const graph::FuncPtr& callee : graph::direct_callees(f)) note(callee.get(), 0);
  }
  return readers;
}

std::optional<StageId> Readers::find_outside(FuncId id, const Level& level) const {
  for (const StageId reader : plan_.program->readers[static_cast<size_t>(id)]) {
    if (is_inlined(plan_, reader.func)) {
      if (const auto outside = find_outside(reader.func, level)) return outside;
    } else if (!is_inside(reader, level)) {
      return reader;
    }
  }
  return std::nullopt;
}

bool Readers::is_place_inside(const LoopRef& loop, const Level& level) const {
  const auto depth = depth_in(plan_, loop.stage, level);
  return depth ? loop.depth >= *depth : is_inside(loop.stage, level);
}

// Whether all loops of the stage are inside of the level's loop. Unknown places count as inside.
bool Readers::is_inside(StageId stage, const Level& level) const {
  if (depth_in(plan_, stage, level)) return true;
  const FuncPlan& plan = plan_.of(stage.func);
  const Level& compute = plan.placement.compute;
  if (plan.opacity != Opacity::None) {
    const graph::StageLoops& schedule = func(stage.func).stage(stage.stage).schedule;
    if (schedule.fuse_level.kind == graph::LoopLevel::Kind::At) return true;
    if (compute.kind == Level::Kind::Undecided) return !is_output(*plan_.program, stage.func);
  }
  return compute.kind == Level::Kind::At && is_place_inside(compute.loop, level);
}

}  // namespace retrograde::planning

// A loop takes another step, or becomes two, in all stages that share it; what is computed in it follows.
#include <algorithm>
#include <utility>

#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/readers.h"

namespace retrograde::planning::moves {

namespace {

using Kind = Level::Kind;

// The loop that a Func is computed in, perhaps through loops of others, from this loop inwards.
std::optional<LoopRef> place_inside(const Plan& plan, FuncId guest, const LoopRef& loop) {
  const Level* level = &plan.of(guest).placement.compute;
  while (level->kind == Kind::At) {
    const bool is_inside = level->loop.depth >= loop.depth &&
                           owner_of(plan, {level->loop.stage, loop.depth}) == loop.stage;
    if (is_inside) return level->loop;
    level = &plan.of(level->loop.stage.func).placement.compute;
  }
  return std::nullopt;
}

// Whether smaller steps decide the box that is needed down to a loop.
bool has_smaller_step(const Nest& nest, int depth, int inner_depth) {
  const auto first = nest.loops.begin() + depth, last = nest.loops.begin() + inner_depth + 1;
  return std::ranges::find(first + 1, last, first->iterator, &Loop::iterator) != last;
}

// Funcs whose loops no plan describes have no nests.
bool runs_in(const Plan& plan, StageId stage, const LoopRef& own) {
  if (static_cast<size_t>(stage.stage) >= plan.of(stage.func).nests.size()) return false;
  return plan.nest(stage).loops.size() > static_cast<size_t>(own.depth) &&
         owner_of(plan, {stage, own.depth}) == own.stage;
}

void change_step(Nest& nest, int depth, int64_t step) {
  const auto at = nest.loops.begin() + depth;
  const Loop loop = *at;
  nest.loops.erase(at);
  insert_step(nest, loop.iterator, step, static_cast<size_t>(depth), loop.kind);
}

}  // namespace

std::optional<Plan> with_step(const Plan& plan, const LoopRef& loop, int64_t step,
                              const Context& context) {
  const LoopRef own{owner_of(plan, loop), loop.depth};
  Plan result = plan;
  for (size_t f = 0; f < plan.funcs.size(); ++f) {
    const auto func = static_cast<FuncId>(f);
    const std::optional<LoopRef> place = place_inside(plan, func, own);
    if (place && !has_smaller_step(plan.nest(place->stage), own.depth, place->depth) &&
        (has_window(plan.of(func)) || !runs_at_any_size(plan.of(func), context, func)))
      return std::nullopt;
    FuncPlan changed = *plan.funcs[f];
    for (size_t s = 0; s < changed.nests.size(); ++s) {
      const StageId stage{func, static_cast<int16_t>(s)};
      if (runs_in(plan, stage, own)) change_step(changed.nests[s], own.depth, step);
    }
    if (!(changed == *plan.funcs[f]))
      result.funcs[f] = std::make_shared<FuncPlan>(std::move(changed));
  }
  return broken_structure(result, plan).empty() ? std::optional(std::move(result)) : std::nullopt;
}

std::optional<Plan> with_strips(const Plan& plan, const LoopRef& rows, int64_t step) {
  const LoopRef own{owner_of(plan, rows), rows.depth};
  Plan result = plan;
  for (size_t f = 0; f < plan.funcs.size(); ++f) {
    FuncPlan changed = *plan.funcs[f];
    const auto follow = [&](LoopRef& loop) {
      if (loop.depth >= own.depth && runs_in(plan, loop.stage, own)) ++loop.depth;
    };
    for (Level* level :
         {&changed.placement.compute, &changed.placement.store, &changed.placement.hoist}) {
      if (level->kind == Kind::At) follow(level->loop);
    }
    for (size_t s = 0; s < changed.nests.size(); ++s) {
      Nest& nest = changed.nests[s];
      if (nest.shared_with) follow(*nest.shared_with);
      if (!runs_in(plan, {static_cast<FuncId>(f), static_cast<int16_t>(s)}, own)) continue;
      Loop& loop = nest.loops[static_cast<size_t>(own.depth)];
      const ForType kind = std::exchange(loop.kind, ForType::Serial);
      insert_step(nest, loop.iterator, step, static_cast<size_t>(own.depth), kind);
    }
    if (!(changed == *plan.funcs[f]))
      result.funcs[f] = std::make_shared<FuncPlan>(std::move(changed));
  }
  return broken_structure(result, plan).empty() ? std::optional(std::move(result)) : std::nullopt;
}

}  // namespace retrograde::planning::moves

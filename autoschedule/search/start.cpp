#include "autoschedule/search/start.h"

#include <algorithm>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning {

namespace {

// The kept Funcs, opaque ones, and the Funcs in whose loops one of these runs.
std::vector<bool> with_hosts(const Plan& plan, std::vector<bool> kept) {
  const auto keep_host = [&](const Level& level) {
    if (level.kind == Level::Kind::At) kept[static_cast<size_t>(level.loop.stage.func)] = true;
  };
  for (size_t i = 0; i < plan.funcs.size(); ++i) {  // producers first
    const FuncPlan& func = *plan.funcs[i];
    if (func.opacity != Opacity::None) kept[i] = true;
    if (!kept[i]) continue;
    for (const Level* level :
         {&func.placement.compute, &func.placement.store, &func.placement.hoist})
      keep_host(*level);
    for (const Nest& nest : func.nests) {
      if (nest.shared_with) keep_host({Level::Kind::At, *nest.shared_with});
    }
  }
  return kept;
}

// Whether a stage adds more terms in lanes than one chain of additions should.
bool has_lanes_of_long_sum(const Plan& plan, FuncId func, const Context& context) {
  for (size_t s = 0; s < plan.of(func).nests.size(); ++s) {
    const StageId stage{func, static_cast<int16_t>(s)};
    const auto adds_up = [&](const Loop& loop) {
      return loop.kind == ForType::Vectorized && loop.iterator >= 0 &&
             moves::is_reduction(context, stage, loop.iterator);
    };
    const Nest& nest = plan.nest(stage);
    if (!nest.fusions.empty() || std::ranges::none_of(nest.loops, adds_up)) continue;
    const Cover extents = whole_cover(stage, context.sizes);
    double terms = 1;
    for (size_t i = 0; i < extents.size(); ++i) {
      if (moves::is_reduction(context, stage, static_cast<int>(i)))
        terms *= static_cast<double>(extents[i]);
    }
    if (terms > longest_chain) return true;
  }
  return false;
}

// Whether the Func is stored in another order for Funcs that stay, and for no others.
bool is_turned_for(const std::vector<bool>& stays, const Plan& plan, FuncId func,
                   const Context& context) {
  const std::vector<StageId>& readers = context.accesses.consumers(func);
  return !std::ranges::is_sorted(plan.of(func).storage.order) && !readers.empty() &&
         std::ranges::all_of(readers, [&](const StageId& reader) {
           return stays[static_cast<size_t>(reader.func)];
         });
}

}  // namespace

Plan plan_from_nothing(const Plan& plan, const std::vector<bool>& kept, const Context& context) {
  std::vector<bool> stays = kept;
  stays.resize(plan.funcs.size());
  for (size_t i = 0; i < stays.size(); ++i)
    stays[i] = stays[i] || has_lanes_of_long_sum(plan, static_cast<FuncId>(i), context);
  for (size_t i = 0; i < stays.size(); ++i)
    stays[i] = stays[i] || is_turned_for(stays, plan, static_cast<FuncId>(i), context);
  stays = with_hosts(plan, std::move(stays));
  const Plan undecided = undecided_plan(plan.program);
  Plan start = plan;
  for (size_t i = 0; i < plan.funcs.size(); ++i) {
    if (!stays[i]) start.funcs[i] = undecided.funcs[i];
  }
  for (auto f = static_cast<FuncId>(plan.funcs.size()); f-- > 0;) {
    if (stays[static_cast<size_t>(f)]) continue;
    for (const char* move : {"root", "inline_func"}) {
      const std::vector<Plan> plans = find_move(move)->apply(start, f, context);
      if (plans.empty()) continue;
      start = plans.front();
      break;
    }
  }
  return start;
}

}  // namespace retrograde::planning

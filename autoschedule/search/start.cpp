#include "autoschedule/search/start.h"

#include <algorithm>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning {

namespace {

// The kept Funcs, opaque ones, the Funcs in whose loops one of these runs, and those that read it there.
std::vector<bool> with_company(const Plan& plan, std::vector<bool> kept, const Context& context) {
  bool is_more = true;
  const auto keep = [&](FuncId func) {
    is_more |= !kept[static_cast<size_t>(func)];
    kept[static_cast<size_t>(func)] = true;
  };
  const auto keep_host = [&](const Level& level) {
    if (level.kind == Level::Kind::At) keep(level.loop.stage.func);
  };
  for (size_t i = 0; i < plan.funcs.size(); ++i)
    kept[i] = kept[i] || plan.funcs[i]->opacity != Opacity::None;
  while (is_more) {
    is_more = false;
    for (size_t i = 0; i < plan.funcs.size(); ++i) {
      if (!kept[i]) continue;
      const auto& [compute, store, hoist] = plan.funcs[i]->placement;
      for (const Level* level : {&compute, &store, &hoist}) keep_host(*level);
      for (const Nest& nest : plan.funcs[i]->nests) {
        if (nest.shared_with) keep_host({Level::Kind::At, *nest.shared_with});
      }
      if (compute.kind != Level::Kind::At) continue;
      for (const StageId reader : moves::all_readers(plan, context, static_cast<FuncId>(i))) {
        if (!is_inlined(plan, reader.func)) keep(reader.func);
      }
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

}  // namespace

Plan plan_from_nothing(const Plan& plan, const std::vector<bool>& kept, const Context& context) {
  std::vector<bool> stays = kept;
  stays.resize(plan.funcs.size());
  for (size_t i = 0; i < stays.size(); ++i)
    stays[i] = stays[i] || has_lanes_of_long_sum(plan, static_cast<FuncId>(i), context);
  stays = with_company(plan, std::move(stays), context);
  const Plan undecided = undecided_plan(plan.program);
  Plan start = plan;
  for (size_t i = 0; i < plan.funcs.size(); ++i) {
    if (!stays[i]) start.funcs[i] = undecided.funcs[i];
  }
  // Operands of those that stay lie as they read them.
  for (size_t i = 0; i < plan.funcs.size(); ++i) {
    const std::vector<StageId> readers = moves::all_readers(plan, context, static_cast<FuncId>(i));
    const bool is_operand = std::ranges::any_of(
        readers, [&](StageId reader) { return stays[static_cast<size_t>(reader.func)]; });
    if (stays[i] || !is_operand) continue;
    FuncPlan stored = *start.funcs[i];
    stored.storage.order = plan.funcs[i]->storage.order;
    start.funcs[i] = std::make_shared<FuncPlan>(std::move(stored));
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

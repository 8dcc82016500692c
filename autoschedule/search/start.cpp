#include "autoschedule/search/start.h"

#include <algorithm>

#include "autoschedule/access/long_sums.h"
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

// Whether a stage of the Func needs lanes of terms, which no move takes away.
bool needs_lanes_of_terms(FuncId func, const SizeModel& sizes) {
  return std::ranges::any_of(sizes.graph().func(func).stages, [&](const StageNode& stage) {
    return is_long_sum(stage.id, sizes) && is_short_in_lanes(stage.id, sizes);
  });
}

// A C function reads memory, of which moves know no region.
bool is_read_by_extern(const Plan& plan, FuncId func) {
  return std::ranges::any_of(plan.program->readers[static_cast<size_t>(func)], [&](StageId reader) {
    return plan.of(reader.func).opacity == Opacity::Extern;
  });
}

void keep_storage_order(Plan& plan, FuncId func, const Plan& before) {
  FuncPlan stored = plan.of(func);
  stored.storage.order = before.of(func).storage.order;
  plan.funcs[static_cast<size_t>(func)] = std::make_shared<FuncPlan>(std::move(stored));
}

void compute_at_root(Plan& plan, FuncId func) {
  FuncPlan changed = plan.of(func);
  changed.placement.compute.kind = Level::Kind::Root;
  plan.funcs[static_cast<size_t>(func)] = std::make_shared<FuncPlan>(std::move(changed));
}

}  // namespace

Plan plan_from_nothing(const Plan& plan, const std::vector<bool>& kept, const Context& context) {
  std::vector<bool> stays = kept;
  stays.resize(plan.funcs.size());
  stays = with_company(plan, std::move(stays), context);
  const Plan undecided = undecided_plan(plan.program);
  Plan start = plan;
  for (size_t i = 0; i < plan.funcs.size(); ++i) {
    if (stays[i]) continue;
    start.funcs[i] = undecided.funcs[i];
    if (context.device) keep_storage_order(start, static_cast<FuncId>(i), plan);
  }
  // Operands of those that stay lie as they read them.
  for (size_t i = 0; i < plan.funcs.size(); ++i) {
    const std::vector<StageId> readers = moves::all_readers(plan, context, static_cast<FuncId>(i));
    const bool is_operand = std::ranges::any_of(
        readers, [&](StageId reader) { return stays[static_cast<size_t>(reader.func)]; });
    if (stays[i] || !is_operand) continue;
    keep_storage_order(start, static_cast<FuncId>(i), plan);
  }
  for (auto f = static_cast<FuncId>(plan.funcs.size()); f-- > 0;) {
    if (stays[static_cast<size_t>(f)]) continue;
    if (is_read_by_extern(plan, f)) {
      compute_at_root(start, f);
      continue;
    }
    for (const char* move : {"root", "inline_func"}) {
      const std::vector<Plan> plans = find_move(move)->apply(start, f, context);
      if (plans.empty()) continue;
      start = plans.front();
      break;
    }
    if (!context.device && needs_lanes_of_terms(f, context.sizes)) {
      const std::vector<Plan> plans = find_move("reduction_lanes")->apply(start, f, context);
      if (!plans.empty()) start = plans.back();
    }
  }
  return start;
}

}  // namespace retrograde::planning

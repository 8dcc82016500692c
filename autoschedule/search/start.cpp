#include "autoschedule/search/start.h"

namespace retrograde::planning {

namespace {

// The Funcs that run as they do, or in whose loops one of these does.
std::vector<bool> with_hosts(const Plan& plan, std::vector<bool> kept) {
  kept.resize(plan.funcs.size());
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

}  // namespace

Plan plan_from_nothing(const Plan& plan, const std::vector<bool>& kept, const Context& context) {
  const std::vector<bool> stays = with_hosts(plan, kept);
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

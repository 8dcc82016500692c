// What can be said of a schedule without its pipeline.
#include "testing/schedule_spec.h"

#include <algorithm>

#include "diagnostics/error.h"

namespace retrograde::fuzz {

namespace {

using Kind = Directive::Kind;

template <typename T, typename F>
void erase_where(std::vector<T>& list, const F& test) {
  list.erase(std::remove_if(list.begin(), list.end(), test), list.end());
}

void erase_directives(ScheduleSpec& schedule, std::initializer_list<Kind> kinds) {
  for (FuncScheduleSpec& func : schedule.funcs) {
    for (StageSpec& stage : func.stages) {
      erase_where(stage.directives, [&](const Directive& d) {
        return std::find(kinds.begin(), kinds.end(), d.kind) != kinds.end();
      });
    }
  }
}

}  // namespace

Placement at_root() {
  Placement placement;
  placement.where = Placement::Where::Root;
  return placement;
}

void drop_derived(ScheduleSpec& schedule, int index) {
  DerivedFunc& derived = schedule.derived[index];
  const int id = static_cast<int>(schedule.funcs.size() - schedule.derived.size()) + index;
  const bool factored = derived.kind == DerivedFunc::Kind::Factored;
  derived.kind = DerivedFunc::Kind::None;
  if (factored) schedule.funcs[derived.source].stages[derived.stage] = {};
  const auto is_gone = [&](int func, int stage) {
    return func == id || (factored && func == derived.source && stage == derived.stage);
  };
  for (FuncScheduleSpec& func : schedule.funcs) {
    Placement& at = func.placement;
    const bool there = is_gone(at.consumer, at.stage) ||
                       is_gone(at.store_consumer, at.store_stage) ||
                       is_gone(at.hoist_consumer, at.hoist_stage);
    if (there) at = at_root();
    for (StageSpec& stage : func.stages) {
      erase_where(stage.directives,
                  [&](const Directive& d) { return d.kind == Kind::Prefetch && d.source == id; });
    }
  }
  erase_where(schedule.companions,
              [&](const Companion& c) { return c.func == id || c.with == id; });
}

void check_can_be_left_out(const std::string& directive) {
  const std::string known =
      "specialize prefetch async memoize trace hoist_storage fold_storage compute_with rfactor "
      "wrappers";
  if (!directive.empty() && (" " + known + " ").find(" " + directive + " ") != std::string::npos)
    return;
  user_error("leave out " + quoted(directive), "directives are left out by name",
             "it is none of those that can be left out", "Name one of: " + known);
}

void leave_out(ScheduleSpec& schedule, const std::string& directive) {
  check_can_be_left_out(directive);
  const auto drop = [&](auto test) {
    for (size_t i = 0; i < schedule.derived.size(); ++i) {
      if (test(schedule.derived[i].kind)) drop_derived(schedule, static_cast<int>(i));
    }
  };
  using Derived = DerivedFunc::Kind;
  if (directive == "rfactor") return drop([](Derived kind) { return kind == Derived::Factored; });
  if (directive == "wrappers") return drop([](Derived kind) { return kind != Derived::Factored; });
  if (directive == "specialize") {
    return erase_directives(schedule, {Kind::Specialize, Kind::SpecializeFail});
  }
  if (directive == "prefetch") return erase_directives(schedule, {Kind::Prefetch});
  if (directive == "compute_with") return schedule.companions.clear();
  for (FuncScheduleSpec& func : schedule.funcs) {
    if (directive == "async") {
      func.async = false;
    } else if (directive == "memoize") {
      func.memoized = false;
    } else if (directive == "trace") {
      func.traced = false;
    } else if (directive == "hoist_storage") {
      func.placement.hoist_loop.clear();
    } else {
      erase_where(func.rules, [](const DimensionRule& rule) {
        return rule.kind == DimensionRule::Kind::FoldStorage;
      });
    }
  }
}

std::string reduction_loop(int k) { return "r" + std::to_string(k); }
bool is_reduction_loop(const std::string& name) { return name[0] == 'r'; }
bool is_reduction_variable(const std::string& name) {
  return name.size() == 2 && name[0] == 'r' && name[1] >= '0' && name[1] <= '9';
}

const char* tail_name(TailStrategy tail) {
  switch (tail) {
    case TailStrategy::RoundUp:
      return "RoundUp";
    case TailStrategy::GuardWithIf:
      return "GuardWithIf";
    case TailStrategy::Predicate:
      return "Predicate";
    case TailStrategy::PredicateLoads:
      return "PredicateLoads";
    case TailStrategy::PredicateStores:
      return "PredicateStores";
    case TailStrategy::RoundUpAndBlend:
      return "RoundUpAndBlend";
    case TailStrategy::ShiftInwardsAndBlend:
      return "ShiftInwardsAndBlend";
    case TailStrategy::ShiftInwards:
      return "ShiftInwards";
    case TailStrategy::Auto:
      break;
  }
  return "Auto";
}

}  // namespace retrograde::fuzz

#include "graph/directives/give_directive.h"

#include <algorithm>
#include <atomic>
#include <set>

namespace retrograde::graph {

namespace {

// The schedule that a directive changes; it and every schedule around it count as scheduled.
StageLoops& mutable_schedule(const SchedulePlace& place) {
  StageLoops* result = &place.f->stage(place.stage).schedule;
  result->is_given = true;
  for (const int step : place.special) {
    result = &result->specializations[static_cast<size_t>(step)];
    result->is_given = true;
  }
  return *result;
}

// ---- levels of LoopLevel objects, which may be set later ----

using LevelSource = std::shared_ptr<LoopLevelContents> FuncPlacement::*;

// The member of the schedule that holds the object behind a level.
LevelSource source_of(const ComputeAt&) { return &FuncPlacement::compute_from; }
LevelSource source_of(const StoreAt&) { return &FuncPlacement::store_from; }
LevelSource source_of(const HoistStorage&) { return &FuncPlacement::hoist_from; }

// Setting the object later updates the schedule, unless it has another level by then.
template <typename D>
void give_level(D at, const FuncPtr& f) {
  const LevelSource source = source_of(at);
  f->schedule.is_given = true;
  f->schedule.*source = at.from;
  if (at.from->defined) apply_directive(at, *f);
  const LoopLevelContents* raw = at.from.get();
  at.from->followers.push_back([=, weak = f->weak_from_this()](const LoopLevel& now) {
    const auto func = weak.lock();
    if (!func || (func->schedule.*source).get() != raw) return;
    apply_directive(D{{now}}, *func);
    func->version++;
  });
}

// Until the object is set, the stage is not fused with any loop.
void give_level(ComputeWith with, const SchedulePlace& place) {
  if (!with.from->defined) {
    const auto object = reinterpret_cast<uintptr_t>(with.from.get());
    with.level = {LoopLevel::Kind::At, "", std::to_string(object), -1};
  }
  apply_directive(with, mutable_schedule(place));
  with.from->followers.push_back([weak = place.f->weak_from_this(), index = place.stage,
                                  align = with.align,
                                  last = with.level](const LoopLevel& now) mutable {
    const auto func = weak.lock();
    if (!func || !(func->stage(index).schedule.fuse_level == last)) return;
    Directive joined = ComputeWith{{now}, align};
    check_directive({func, index}, joined);
    last = func->stage(index).schedule.fuse_level = now;
    func->version++;
  });
}

void settle(AtLevel& at) {
  if (!at.from) {
    at.from = std::make_shared<LoopLevelContents>();
    at.from->level = at.level;
    at.from->defined = true;
  }
  if (at.from->defined) at.level = at.from->level;
}

}  // namespace

void check_directive(const SchedulePlace& place, Directive& directive) {
  is_of_stage(directive) ? check_stage_directive(place, directive)
                         : check_func_directive(place, directive);
}

void log_directive(const SchedulePlace& place, Directive directive) {
  static std::atomic<uint64_t> order = 0;
  place.f->version++;
  place.f->log.push_back({place.stage, place.special, std::move(directive), ++order});
}

void give_directive(const SchedulePlace& place, Directive directive) {
  std::visit(
      []<typename D>(D& d) {
        if constexpr (std::is_base_of_v<AtLevel, D>) settle(d);
      },
      directive);
  check_directive(place, directive);
  if (const auto* special = std::get_if<Specialize>(&directive);
      special && specialization_for(place.schedule(), special->condition) >= 0)
    return;
  std::visit(
      [&]<typename D>(const D& d) {
        if constexpr (std::is_same_v<D, ComputeWith>) {
          give_level(d, place);
        } else if constexpr (std::is_base_of_v<AtLevel, D>) {
          give_level(d, place.f);
        } else if (is_of_stage(directive)) {
          apply_directive(directive, mutable_schedule(place));
        } else {
          apply_directive(directive, *place.f);
        }
      },
      directive);
  log_directive(place, std::move(directive));
}

template <typename D>
void give_directive(const SchedulePlace& place, D directive) {
  give_directive(place, Directive(std::move(directive)));
}
#define RETROGRADE_GIVE(D) template void give_directive(const SchedulePlace&, D);
RETROGRADE_GIVE(SplitLoop)
RETROGRADE_GIVE(FuseLoops)
RETROGRADE_GIVE(RenameLoop)
RETROGRADE_GIVE(ReorderLoops)
RETROGRADE_GIVE(RunLoop)
RETROGRADE_GIVE(PartitionLoop)
RETROGRADE_GIVE(MakeAtomic)
RETROGRADE_GIVE(AllowRaces)
RETROGRADE_GIVE(Unscheduled)
RETROGRADE_GIVE(PrefetchData)
RETROGRADE_GIVE(ComputeWith)
RETROGRADE_GIVE(Specialize)
RETROGRADE_GIVE(SpecializeFail)
RETROGRADE_GIVE(ComputeAt)
RETROGRADE_GIVE(StoreAt)
RETROGRADE_GIVE(HoistStorage)
RETROGRADE_GIVE(StoreIn)
RETROGRADE_GIVE(ReorderStorage)
RETROGRADE_GIVE(AlignStorage)
RETROGRADE_GIVE(BoundStorage)
RETROGRADE_GIVE(FoldStorage)
RETROGRADE_GIVE(RingBuffer)
RETROGRADE_GIVE(Memoize)
RETROGRADE_GIVE(Async)
RETROGRADE_GIVE(BoundDimension)
RETROGRADE_GIVE(AlignBounds)
RETROGRADE_GIVE(Estimate)
RETROGRADE_GIVE(TraceLoads)
RETROGRADE_GIVE(TraceStores)
RETROGRADE_GIVE(TraceRealizations)
RETROGRADE_GIVE(AddTraceTag)
RETROGRADE_GIVE(DebugToFile)
#undef RETROGRADE_GIVE

namespace {

// Whether directives, by position in the log, come before an rfactor of their stage or are one.
std::vector<bool> are_before_factor(const FuncContents& f) {
  std::vector<bool> result(f.log.size());
  std::set<int> factored;  // stages
  for (size_t i = f.log.size(); i-- > 0;) {
    if (std::holds_alternative<FactorOut>(f.log[i].directive)) factored.insert(f.log[i].stage);
    result[i] = factored.contains(f.log[i].stage);
  }
  return result;
}

}  // namespace

std::vector<Split> factored_names(const FuncContents& f, int stage) {
  const Definition& definition = f.stage(stage);
  const std::vector<Dim> loops = first_loops(f, definition);
  const auto is_directive = [&](const Split& split) {
    return std::ranges::any_of(f.log, [&](const LoggedDirective& logged) {
      const auto* rename = std::get_if<RenameLoop>(&logged.directive);
      return logged.stage == stage && rename && rename->old == split.old_var &&
             rename->renamed == split.outer;
    });
  };
  std::vector<Split> names;
  for (const Split& split : definition.schedule.splits) {
    if (split.kind != Split::Kind::Rename || is_directive(split) ||
        std::ranges::find(loops, split.old_var, &Dim::var) == loops.end())
      break;
    names.push_back(split);
  }
  return names;
}

bool can_reset_loops(const FuncContents& f) {
  const std::vector<bool> stays = are_before_factor(f);
  for (size_t i = 0; i < f.log.size(); ++i) {
    const auto& [stage, special, directive, order] = f.log[i];
    const bool shapes_loops = std::holds_alternative<SplitLoop>(directive) ||
                              std::holds_alternative<FuseLoops>(directive) ||
                              std::holds_alternative<ReorderLoops>(directive) ||
                              std::holds_alternative<FactorOut>(directive);
    // Splits of pure loops stand before the names.
    if (stays[i] &&
        (!shapes_loops || factored_names(f, stage).size() != f.stage(stage).rvars.size()))
      return false;
  }
  return true;
}

void reset_loops(FuncContents& f) {
  std::vector<std::vector<Split>> names;
  for (int s = 0; s < f.stage_count(); ++s) names.push_back(factored_names(f, s));
  const std::vector<bool> stays = are_before_factor(f);
  size_t at = 0;
  std::erase_if(f.log, [&](const LoggedDirective& logged) {
    const bool is_before = stays[at++];
    return logged.stage >= 0 && !is_before;
  });
  for (int s = 0; s < f.stage_count(); ++s) {
    Definition& stage = f.stage(s);
    stage.schedule = StageLoops();
    stage.schedule.dims = first_loops(f, stage);
    for (const Split& name : names[static_cast<size_t>(s)])
      std::ranges::find(stage.schedule.dims, name.old_var, &Dim::var)->var = name.outer;
    stage.schedule.splits = std::move(names[static_cast<size_t>(s)]);
  }
  f.version++;
}

bool has_directives(const FuncContents& f) {
  if (f.schedule.is_given) return true;
  for (int s = 0; s < f.stage_count(); ++s) {
    if (f.stage(s).schedule.is_given) return true;
  }
  return false;
}

}  // namespace retrograde::graph

// import.cpp -- reads the directives of a scheduled graph into a plan.
//
// Method: each Func by itself first; loops that other Funcs refer to are numbered by their depth. Then the references
// between Funcs: a Func in whose loops an opaque one runs is opaque, too, since its loops must keep their names.
// Linear in the number of Funcs, apart from chains of shared loops.
#include <algorithm>
#include <unordered_map>

#include "autoschedule/plan/loop_names.h"
#include "autoschedule/plan/nest.h"
#include "autoschedule/plan/plan.h"
#include "autoschedule/plan/split_history.h"
#include "graph/directives/give_directive.h"
#include "graph/names.h"
#include "ir/build.h"

namespace retrograde::planning {

namespace {

using graph::FuncContents;
using graph::LoopLevel;
using graph::StageLoops;

Concurrency concurrency_of(const StageLoops& schedule) {
  if (schedule.allow_races)
    return schedule.atomic ? Concurrency::AtomicRacing : Concurrency::Racing;
  if (!schedule.atomic) return Concurrency::Independent;
  return schedule.override_associativity ? Concurrency::Vouched : Concurrency::Atomic;
}

// The reason why the Func is opaque whatever its loops are.
Opacity opacity_of(const FuncContents& f) {
  if (f.is_extern()) return Opacity::Extern;
  if (f.schedule.async) return Opacity::Async;
  if (f.schedule.memoized) return Opacity::Memoize;
  if (f.schedule.ring.defined()) return Opacity::Ring;
  for (int s = 0; s < f.stage_count(); ++s) {
    const StageLoops& schedule = f.stage(s).schedule;
    if (!schedule.specializations.empty()) return Opacity::Specialize;
    if (!schedule.prefetches.empty()) return Opacity::Prefetch;
  }
  return Opacity::None;
}

int16_t dimension_of(const FuncContents& f, const std::string& name) {
  return static_cast<int16_t>(std::ranges::find(f.args, name) - f.args.begin());
}

Opacity read_storage(const FuncContents& f, Storage& storage) {
  storage.order.clear();
  for (const std::string& name : f.schedule.storage_dims)
    storage.order.push_back(dimension_of(f, name));
  storage.memory = f.schedule.memory;
  for (const graph::StorageRule& rule : f.schedule.storage_rules) {
    if (!rule.fold.defined()) continue;
    const auto extent = as_const_int(rule.fold);
    if (!extent) return Opacity::SymbolicFold;
    storage.folds.push_back({dimension_of(f, rule.var), *extent, rule.fold_forward});
  }
  std::ranges::sort(storage.folds, {}, &Fold::dimension);
  return Opacity::None;
}

class PlanImporter {
 public:
  explicit PlanImporter(const std::vector<graph::FuncPtr>& outputs)
      : program_(make_program(outputs)) {
    const auto& funcs = program_->funcs;
    for (size_t i = 0; i < funcs.size(); ++i) ids_[funcs[i]->name] = static_cast<FuncId>(i);
  }

  Plan run() {
    for (const graph::FuncPtr& f : program_->funcs) plans_.push_back(read_alone(*f));
    const auto count = static_cast<FuncId>(plans_.size());
    for (FuncId f = 0; f < count; ++f) read_placement(f);
    for (FuncId f = 0; f < count; ++f) read_sharing(f);
    spread_opacity();
    Plan plan{program_, {}};
    for (FuncPlan& func : plans_) plan.funcs.push_back(std::make_shared<FuncPlan>(std::move(func)));
    return plan;
  }

 private:
  const ProgramPtr program_;
  std::unordered_map<std::string, FuncId> ids_;
  std::vector<FuncPlan> plans_;

  const FuncContents& func(FuncId id) const { return *program_->funcs[static_cast<size_t>(id)]; }
  FuncPlan& plan(FuncId id) { return plans_[static_cast<size_t>(id)]; }
  void make_opaque(FuncId id, Opacity why) {
    plan(id).opacity = why;
    plan(id).nests.clear();
    plan(id).storage = undecided_storage(func(id));
  }
  static Storage undecided_storage(const FuncContents& f) {
    Storage storage;
    for (int d = 0; d < f.dimensions(); ++d) storage.order.push_back(static_cast<int16_t>(d));
    return storage;
  }

  FuncPlan read_alone(const FuncContents& f) const {
    FuncPlan plan;
    plan.opacity = opacity_of(f);
    if (plan.opacity == Opacity::None) plan.opacity = read_storage(f, plan.storage);
    for (int s = 0; s < f.stage_count() && plan.opacity == Opacity::None; ++s) {
      History history = history_of(f, s);
      history.nest.concurrency = concurrency_of(f.stage(s).schedule);
      plan.nests.push_back(std::move(history.nest));
      plan.opacity = history.why;
    }
    if (plan.opacity == Opacity::None) return plan;
    return {{}, undecided_storage(f), {}, plan.opacity};
  }

  // ---- levels ----

  // The depth of a loop by its name; nullopt when the stage has no such loop.
  std::optional<int16_t> depth_of(const FuncContents& f, int stage, const std::string& loop) const {
    const graph::LoopList& dims = f.stage(stage).schedule.dims;
    for (size_t i = 0; i < dims.size(); ++i) {
      if (dims[i].var == loop) return static_cast<int16_t>(dims.size() - 1 - i);
    }
    if (loop == graph::outermost_loop) return around_all_loops;
    return std::nullopt;
  }

  // Whether two loops of stages of one Func have equal iterators and steps, so that they get equal names.
  bool are_alike(const FuncContents& f, const LoopRef& a, const LoopRef& b) {
    if (a == b) return true;
    if (shares_loops(f, a.stage.stage) || shares_loops(f, b.stage.stage)) return false;
    if (a.depth < 0 || b.depth < 0) return a.depth == b.depth;
    if (plan(a.stage.func).opacity != Opacity::None) return true;  // it keeps its names
    return loop_name(f, plan(a.stage.func), a) == loop_name(f, plan(b.stage.func), b);
  }
  // Whether its loops get the names of another Func's.
  static bool shares_loops(const FuncContents& f, int stage) {
    const LoopLevel& level = f.stage(stage).schedule.fuse_level;
    return level.kind == LoopLevel::Kind::At && level.func != f.name;
  }
  static std::string loop_name(const FuncContents& f, const FuncPlan& plan, const LoopRef& loop) {
    const Nest& nest = plan.nests[static_cast<size_t>(loop.stage.stage)];
    return loop_names(f, loop.stage.stage, nest).loops[static_cast<size_t>(loop.depth)];
  }

  // A level that names no stage means the loop of that name in each stage.
  Opacity read_level(const LoopLevel& level, Level& result) {
    switch (level.kind) {
      case LoopLevel::Kind::Inlined:
        return Opacity::None;
      case LoopLevel::Kind::Root:
        result.kind = Level::Kind::Root;
        return Opacity::None;
      case LoopLevel::Kind::At:
        break;
    }
    const auto id = ids_.find(level.func);
    if (id == ids_.end()) return Opacity::UnknownLoop;
    const FuncContents& f = func(id->second);
    std::vector<LoopRef> found;
    for (int s = 0; s < f.stage_count(); ++s) {
      if (level.stage >= 0 && level.stage != s) continue;
      if (const auto depth = depth_of(f, s, level.var))
        found.push_back({{id->second, static_cast<int16_t>(s)}, *depth});
    }
    if (found.empty()) return Opacity::UnknownLoop;
    result = {Level::Kind::At, found.front(), found.size() > 1};
    const bool alike = std::ranges::all_of(
        found, [&](const LoopRef& loop) { return are_alike(f, found.front(), loop); });
    return alike ? Opacity::None : Opacity::DifferentLoops;
  }

  // Whether the Func has directives, or loops that rfactor gave it.
  bool is_scheduled(FuncId id) {
    const FuncContents& f = func(id);
    const std::vector<Nest>& nests = plan(id).nests;
    for (size_t s = 0; s < nests.size(); ++s) {
      if (!(nests[s] == loops_of_definition(f, static_cast<int>(s)))) return true;
    }
    return graph::has_directives(f);
  }

  // A scheduled Func without a compute level is inlined; an output is at root instead.
  void read_placement(FuncId id) {
    const FuncContents& f = func(id);
    Placement placement;
    const graph::FuncPlacement& schedule = f.schedule;
    Opacity why = read_level(schedule.compute_level, placement.compute);
    if (why == Opacity::None && !(schedule.store_level == schedule.compute_level))
      why = read_level(schedule.store_level, placement.store);
    if (why == Opacity::None) why = read_level(schedule.hoist_level, placement.hoist);
    if (why != Opacity::None) return make_opaque(id, why);
    if (placement.compute.kind == Level::Kind::Undecided && is_scheduled(id)) {
      placement.compute.kind = is_output(*program_, id) ? Level::Kind::Root : Level::Kind::Inline;
    }
    plan(id).placement = placement;
  }

  // ---- loop fusion ----

  void read_sharing(FuncId id) {
    const FuncContents& f = func(id);
    for (int s = 0; s < f.stage_count(); ++s) {
      const LoopLevel& level = f.stage(s).schedule.fuse_level;
      if (level.kind != LoopLevel::Kind::At || plan(id).opacity != Opacity::None) continue;
      LoopLevel named = level;
      named.stage = std::max(level.stage, 0);
      Level shared;
      if (const Opacity why = read_level(named, shared); why != Opacity::None)
        return make_opaque(id, why);
      Nest& nest = plan(id).nests[static_cast<size_t>(s)];
      nest.shared_with = shared.loop;
      for (size_t d = 0; d < nest.loops.size(); ++d) {
        if (static_cast<int>(d) > shared.loop.depth) nest.loops[d].align = LoopAlignStrategy::Auto;
      }
    }
  }

  // Makes the Funcs opaque in whose loops an opaque one runs, since that names them; returns whether there were any.
  bool spread_opacity_once() {
    bool changed = false;
    for (size_t i = 0; i < plans_.size(); ++i) {
      const FuncContents& f = *program_->funcs[i];
      if (plans_[i].opacity == Opacity::None) continue;
      for (int s = 0; s < f.stage_count(); ++s) {
        const LoopLevel& level = f.stage(s).schedule.fuse_level;
        if (level.kind != LoopLevel::Kind::At) continue;
        const auto host = ids_.find(level.func);
        if (host == ids_.end() || plan(host->second).opacity != Opacity::None) continue;
        make_opaque(host->second, Opacity::SharedLoops);
        changed = true;
      }
    }
    return changed;
  }
  void spread_opacity() {
    while (spread_opacity_once()) {
    }
  }
};

}  // namespace

Plan import_plan(const std::vector<graph::FuncPtr>& outputs) { return PlanImporter(outputs).run(); }

}  // namespace retrograde::planning

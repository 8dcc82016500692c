// emit.cpp -- gives the directives of a plan to a copy of its program.
//
//   x:32 GuardWithIf, y, unroll x:16, vector x
//     =>   split(x, x, x_1, 32, GuardWithIf), split(x_1, x_1, x_2, 16, Auto), reorder(x_2, x_1, y, x),
//          run(x_1, Unrolled), run(x_2, Vectorized)
//
// Method: the nests of all Funcs, then loop fusion, placements and storage, which name loops of others. For each nest: the
// order of the reduction variables, one split for each step but the smallest, one fusion for each of the nest's, one
// reorder, one kind for each loop. A stage that shares loops renames its own.
#include <algorithm>
#include <set>

#include "autoschedule/plan/loop_names.h"
#include "autoschedule/plan/nest.h"
#include "autoschedule/plan/plan.h"
#include "graph/copy_graph.h"
#include "graph/directives/give_directive.h"
#include "graph/names.h"
#include "ir/build.h"

namespace retrograde::planning {

namespace {

using graph::FuncContents;
using graph::FuncPtr;
using graph::LoopLevel;

// ---- what the graph had ----

template <typename... D>
void drop_from_log(FuncContents& f) {
  std::erase_if(f.log, [](const graph::LoggedDirective& logged) {
    return (std::holds_alternative<D>(logged.directive) || ...);
  });
}

void clear_placement(FuncContents& f) {
  graph::FuncPlacement& schedule = f.schedule;
  schedule.compute_level = schedule.store_level = schedule.hoist_level = {};
  schedule.compute_from = schedule.store_from = schedule.hoist_from = nullptr;
  drop_from_log<graph::ComputeAt, graph::StoreAt, graph::HoistStorage>(f);
}

// Alignments and bounds of storage are about sizes, and stay.
void clear_storage(FuncContents& f) {
  f.schedule.storage_dims = f.args;
  f.schedule.memory = MemoryType::Auto;
  for (graph::StorageRule& rule : f.schedule.storage_rules) {
    rule.fold = Expr();
    rule.fold_forward = true;
  }
  std::erase_if(f.schedule.storage_rules, [](const graph::StorageRule& rule) {
    return !rule.alignment.defined() && !rule.bound.defined();
  });
  drop_from_log<graph::StoreIn, graph::ReorderStorage, graph::FoldStorage>(f);
}

// ---- one nest ----

class NestEmitter {
 public:
  NestEmitter(const FuncPtr& f, int stage, const Nest& nest)
      : place_{f, stage},
        nest_(nest),
        names_(loop_names(*f, stage, nest)),
        is_factored_(!graph::factored_names(*f, stage).empty()) {}

  void run() const {
    const Concurrency how = nest_.concurrency;
    if (how == Concurrency::Racing || how == Concurrency::AtomicRacing) give(graph::AllowRaces{});
    if (how != Concurrency::Racing && how != Concurrency::Independent)
      give(graph::MakeAtomic{how == Concurrency::Vouched});
    reorder_variables();
    const size_t own = names_.parts.size() - nest_.fusions.size();
    for (size_t i = 0; i < names_.parts.size(); ++i) {
      if (i >= own) fuse(nest_.fusions[i - own], names_.parts[i][0]);
      split(parts_of(nest_, static_cast<int>(i)), names_.parts[i]);
    }
    reorder();
    for (size_t d = 0; d < nest_.loops.size(); ++d) {
      if (nest_.loops[d].kind != ForType::Serial)
        give(graph::RunLoop{names_.loops[d], nest_.loops[d].kind});
    }
  }

 private:
  const graph::SchedulePlace place_;
  const Nest& nest_;
  const LoopNames names_;
  // Directives before an rfactor, which the log keeps, may have put its loops into another order than they have here.
  const bool is_factored_;

  template <typename D>
  void give(D directive) const {
    graph::give_directive(place_, std::move(directive));
  }

  // Reduction variables go into the order of their outermost loops before they are split: the new order is easier to
  // prove legal while each has one loop.
  void reorder_variables() const {
    std::vector<graph::NamedLoop> now, wanted;
    for (const graph::Dim& dim : place_.schedule().dims) {
      if (dim.is_reduction) now.emplace_back(dim.var);
    }
    for (const Loop& loop : nest_.loops) add_variables(loop, now, wanted);
    std::ranges::reverse(wanted);
    if (!wanted.empty() && (wanted != now || is_factored_)) give(graph::ReorderLoops{wanted});
  }
  // Adds the variables of a part that are not in the list yet, those of the outer loop first.
  void add_variables(const Part& part, const std::vector<graph::NamedLoop>& variables,
                     std::vector<graph::NamedLoop>& list) const {
    const size_t own = names_.parts.size() - nest_.fusions.size();
    if (part.iterator == once) return;
    const auto i = static_cast<size_t>(part.iterator);
    if (i >= own) {
      add_variables(nest_.fusions[i - own].outer, variables, list);
      add_variables(nest_.fusions[i - own].inner, variables, list);
      return;
    }
    const std::string& name = names_.parts[i][0];
    const auto is_in = [&](const std::vector<graph::NamedLoop>& names) {
      return std::ranges::find(names, name) != names.end();
    };
    if (is_in(variables) && !is_in(list)) list.emplace_back(name);
  }

  void fuse(const Fusion& fusion, const std::string& fused) const {
    give(graph::FuseLoops{names_.of(nest_, fusion.inner), names_.of(nest_, fusion.outer), fused});
  }

  // Splits the loop of parts [first, last], which has the name of the first, after part `at`.
  void split(const std::vector<Part>& parts, const std::vector<std::string>& names) const {
    std::vector<bool> is_split(parts.size(), false);
    for (const size_t at : split_order(parts)) {
      size_t first = at, last = at + 1;
      while (first > 0 && !is_split[first - 1]) --first;
      while (last + 1 < parts.size() && !is_split[last]) ++last;
      const auto factor = static_cast<int32_t>(parts[at].step / parts[last].step);
      give(graph::SplitLoop{names[first], names[first], names[at + 1], factor, parts[at].tail});
      is_split[at] = true;
    }
  }

  void reorder() const {
    std::vector<graph::NamedLoop> wanted, now;
    for (size_t d = nest_.loops.size(); d-- > 0;) {
      if (nest_.loops[d].iterator != once) wanted.emplace_back(names_.loops[d]);
    }
    for (const graph::Dim& dim : place_.schedule().dims) now.emplace_back(dim.var);
    if (wanted != now || is_factored_) give(graph::ReorderLoops{wanted});
  }
};

// ---- the program ----

class PlanEmitter {
 public:
  // `kept`: the plan of the directives that the program has; null: all of them are given anew.
  PlanEmitter(const Plan& plan, const Plan* kept)
      : plan_(plan), copy_(graph::copy_graph(plan.program->outputs)) {
    for (size_t i = 0; i < plan.funcs.size(); ++i)
      changes_.push_back(!kept || !(*plan.funcs[i] == *kept->funcs[i]));
    while (spread_changes()) {
    }
  }

  std::vector<FuncPtr> run() {
    const auto count = static_cast<FuncId>(plan_.funcs.size());
    for (FuncId id = 0; id < count; ++id) emit_nests(id);
    for (FuncId id = 0; id < count; ++id) {
      for (int s = 0; s < func(id)->stage_count(); ++s) emit_sharing({id, static_cast<int16_t>(s)});
    }
    for (FuncId id = count; id-- > 0;) emit_func(id);
    return copy_.outputs;
  }

 private:
  const Plan& plan_;
  const graph::GraphCopy copy_;
  std::vector<bool> changes_;  // by Func: gets directives
  std::set<StageId> shared_;   // with their directives about loop fusion

  bool changes(FuncId id) const { return changes_[static_cast<size_t>(id)]; }
  // Loops that a Func shares have the names of their owner's, which may change. Returns whether a Func was added.
  bool spread_changes() {
    bool found = false;
    for (size_t i = 0; i < changes_.size(); ++i) {
      for (const Nest& nest : plan_.funcs[i]->nests) {
        if (changes_[i] || !nest.shared_with || !changes(nest.shared_with->stage.func)) continue;
        changes_[i] = found = true;
      }
    }
    return found;
  }

  const FuncPtr& func(FuncId id) const {
    return copy_.of.at(plan_.program->funcs[static_cast<size_t>(id)].get());
  }

  void emit_nests(FuncId id) const {
    const FuncPlan& plan = plan_.of(id);
    if (plan.opacity != Opacity::None || !changes(id)) return;
    const FuncPtr& f = func(id);
    graph::reset_loops(*f);
    clear_placement(*f);
    clear_storage(*f);
    f->schedule.is_given = false;
    for (int s = 0; s < f->stage_count(); ++s) {
      const Nest& nest = plan.nests[static_cast<size_t>(s)];
      NestEmitter(f, s, nest).run();
    }
  }

  const graph::Dim& dim_of(const LoopRef& loop) const {
    const graph::LoopList& dims = func(loop.stage.func)->stage(loop.stage.stage).schedule.dims;
    return dims[dims.size() - 1 - static_cast<size_t>(loop.depth)];
  }
  std::string loop_name(const LoopRef& loop) const {
    return loop.depth == around_all_loops ? graph::outermost_loop : dim_of(loop).var;
  }

  LoopLevel level_of(const Level& level) const {
    switch (level.kind) {
      case Level::Kind::Undecided:
      case Level::Kind::Inline:
        return {};
      case Level::Kind::Root:
        return {LoopLevel::Kind::Root, "", "", -1};
      case Level::Kind::At:
        break;
    }
    return {LoopLevel::Kind::At, func(level.loop.stage.func)->name, loop_name(level.loop),
            level.in_each_stage ? -1 : level.loop.stage.stage};
  }

  void emit_placement(const FuncPtr& f, const Placement& placement) const {
    const graph::SchedulePlace place{f};
    using Kind = Level::Kind;
    if (placement.compute.kind != Kind::Undecided)
      graph::give_directive(place, graph::ComputeAt{{level_of(placement.compute)}});
    if (placement.store.kind != Kind::Undecided)
      graph::give_directive(place, graph::StoreAt{{level_of(placement.store)}});
    if (placement.hoist.kind != Kind::Undecided)
      graph::give_directive(place, graph::HoistStorage{{level_of(placement.hoist)}});
  }

  void emit_storage(const FuncPtr& f, const Storage& storage) const {
    const graph::SchedulePlace place{f};
    if (storage.memory != MemoryType::Auto)
      graph::give_directive(place, graph::StoreIn{storage.memory});
    if (!std::ranges::is_sorted(storage.order)) {
      graph::give_directive(place, graph::ReorderStorage{mapped(storage.order, [&](int16_t d) {
                              return f->args[static_cast<size_t>(d)];
                            })});
    }
    for (const Fold& fold : storage.folds) {
      graph::give_directive(place,
                            graph::FoldStorage{f->args[static_cast<size_t>(fold.dimension)],
                                               static_cast<int32_t>(fold.extent), fold.forward});
    }
  }

  // ---- loop fusion ----

  // A stage that owns its loops has its names; then come the stages that share them.
  void emit_sharing(StageId stage) {
    const bool is_kept = plan_.of(stage.func).opacity != Opacity::None || !changes(stage.func);
    if (is_kept || !shared_.insert(stage).second) return;
    const Nest& nest = plan_.nest(stage);
    if (!nest.shared_with) return;
    emit_sharing(nest.shared_with->stage);
    const graph::SchedulePlace place{func(stage.func), stage.stage};
    for (int16_t d = 0; d <= nest.shared_with->depth; ++d) {
      const LoopRef own{stage, d}, host{nest.shared_with->stage, d};
      if (!dim_of(own).is_reduction || !dim_of(host).is_reduction)
        rename(place, dim_of(own).var, dim_of(host).var);
    }
    graph::ComputeWith with{{level_of({Level::Kind::At, *nest.shared_with})}};
    for (size_t d = 0; d < nest.loops.size(); ++d) {
      const LoopAlignStrategy align = nest.loops[d].align;
      if (align != LoopAlignStrategy::Auto)
        with.align.emplace_back(loop_name({stage, static_cast<int16_t>(d)}), align);
    }
    graph::give_directive(place, std::move(with));
  }

  // Loops that run as one have equal names, unless both are over reduction variables.
  void rename(const graph::SchedulePlace& place, const std::string from,
              const std::string to) const {
    if (from == to) return;
    const graph::LoopList& dims = place.schedule().dims;
    const auto is_taken = [&](const std::string& name) {
      return std::ranges::find(dims, name, &graph::Dim::var) != dims.end();
    };
    if (is_taken(to)) {
      std::string other = to + "_";
      while (is_taken(other)) other += "_";
      graph::give_directive(place, graph::RenameLoop{to, other});
    }
    graph::give_directive(place, graph::RenameLoop{from, to});
  }

  bool is_in_changed_loop(const Placement& placement) const {
    const auto changes_at = [&](const Level& level) {
      return level.kind == Level::Kind::At && changes(level.loop.stage.func);
    };
    return changes_at(placement.compute) || changes_at(placement.store) ||
           changes_at(placement.hoist);
  }

  // A Func that keeps its directives has to learn the new name of a loop in which it is computed.
  void emit_func(FuncId id) const {
    const FuncPlan& plan = plan_.of(id);
    const FuncPtr& f = func(id);
    if (plan.opacity != Opacity::None || !changes(id)) {
      if (!is_in_changed_loop(plan.placement)) return;
      clear_placement(*f);
      return emit_placement(f, plan.placement);
    }
    emit_placement(f, plan.placement);
    emit_storage(f, plan.storage);
  }
};

}  // namespace

std::vector<FuncPtr> emit_plan(const Plan& plan) { return PlanEmitter(plan, nullptr).run(); }

std::vector<FuncPtr> emit_changes(const Plan& plan, const Plan& kept) {
  return PlanEmitter(plan, &kept).run();
}

}  // namespace retrograde::planning

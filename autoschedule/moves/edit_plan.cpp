// The changes of a plan: what refers to loops that changed, and which plans are dropped.
#include <algorithm>

#include "autoschedule/access/long_sums.h"
#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/nest.h"

namespace retrograde::planning::moves {

namespace {

using Kind = Level::Kind;

bool is_at(const Level& level, FuncId func) {
  return level.kind == Kind::At && level.loop.stage.func == func;
}

bool has_equal_loops(const Nest& a, const Nest& b, int depth) {
  const auto count = static_cast<size_t>(depth + 1);
  return a.loops.size() >= count && b.loops.size() >= count &&
         std::equal(a.loops.begin(), a.loops.begin() + static_cast<std::ptrdiff_t>(count),
                    b.loops.begin());
}

// The smallest step of an iterator down to a loop; 0: none, so all of its points run inside.
int64_t span(const Nest& nest, int depth, int iterator) {
  int64_t result = 0;
  for (int d = 0; d <= depth; ++d) {
    const Loop& loop = nest.loops[static_cast<size_t>(d)];
    if (loop.iterator == iterator && (result == 0 || loop.step < result)) result = loop.step;
  }
  return result;
}

// The nest if no loop is two, or none; else such a nest, in `room`.
const Nest& plain(const Context& context, StageId stage, const Nest& nest, Nest& room) {
  if (nest.fusions.empty() && (nest.loops.empty() || nest.loops[0].iterator != once)) return nest;
  room = unfused(nest, static_cast<int>(context.accesses.stage(stage).iterators.size()));
  return room;
}

// The loops over the reduction, where neighbours of one iterator count as one: steps of it change no order.
std::vector<LoopStep> reduction_loops(const Context& context, StageId stage, const Nest& nest) {
  Nest room;
  std::vector<LoopStep> loops;
  for (const Loop& loop : plain(context, stage, nest, room).loops) {
    if (!is_reduction(context, stage, loop.iterator)) continue;
    const bool at_once = loop.kind == ForType::Vectorized || runs_at_once(loop.kind);
    const bool is_next = !loops.empty() && loops.back().iterator == loop.iterator &&
                         loops.back().is_concurrent == at_once;
    if (is_next) loops.pop_back();
    loops.push_back({loop.iterator, loop.step, at_once});
  }
  return loops;
}

// Whether loops that run at once, and are neither atomic nor vouched for, may.
bool are_independent(const Context& context, StageId stage, const Nest& fused) {
  if (fused.concurrency != Concurrency::Independent) return true;
  Nest room;
  const Nest& nest = plain(context, stage, fused, room);
  for (size_t d = 0; d < nest.loops.size(); ++d) {
    const ForType kind = nest.loops[d].kind;
    const bool at_once = kind == ForType::Vectorized || runs_at_once(kind);
    if (at_once && !may_run_at_once(context, stage, nest, d)) return false;
  }
  return true;
}

// One change of a Func in a plan.
class FuncChange {
 public:
  FuncChange(const Plan& plan, FuncId func, FuncPlan changed, const Context& context, Terms terms)
      : before_(plan), context_(context), func_(func), changed_(std::move(changed)), terms_(terms) {
    is_moved_ = !(changed_.placement == before().placement);
    for (size_t id = 0; id < plan.funcs.size(); ++id)
      if (is_bound(*plan.funcs[id])) bound_.push_back(static_cast<FuncId>(id));
  }

  std::optional<Plan> run() {
    if (!keeps_order() || !keeps_short_chains() || !keeps_shared_loops()) return std::nullopt;
    Plan plan = before_;
    plan.funcs[static_cast<size_t>(func_)] = std::make_shared<FuncPlan>(changed_);
    if (is_moved_ && reads_window()) return std::nullopt;
    for (const FuncId guest : bound_) {
      if (guest != func_ && (!keeps_region(guest) || !renumber(plan, guest))) return std::nullopt;
    }
    if (!broken_structure(plan, before_).empty()) return std::nullopt;
    return plan;
  }

 private:
  const Plan& before_;
  const Context& context_;
  const FuncId func_;
  const FuncPlan changed_;
  const Terms terms_;
  bool is_moved_ = false;
  std::vector<FuncId> bound_;  // the Funcs that may refer to loops of others

  const FuncPlan& before() const { return before_.of(func_); }
  const Nest& old_nest(StageId stage) const { return before_.nest(stage); }
  const Nest& new_nest(StageId stage) const {
    return changed_.nests[static_cast<size_t>(stage.stage)];
  }

  // The loop of the same part; nullopt: it is gone.
  std::optional<int16_t> new_depth(const LoopRef& loop) const {
    if (loop.depth == around_all_loops) return loop.depth;
    const Loop& old = old_nest(loop.stage).loops[static_cast<size_t>(loop.depth)];
    const auto found = find_loop(new_nest(loop.stage), old.iterator, old.step);
    return found ? std::optional(static_cast<int16_t>(*found)) : std::nullopt;
  }

  // ---- L1, L2 ----

  static bool are_alike(const std::vector<LoopStep>& a, const std::vector<LoopStep>& b) {
    return std::ranges::equal(a, b, [](const LoopStep& s, const LoopStep& t) {
      return s.iterator == t.iterator && s.is_concurrent == t.is_concurrent;
    });
  }
  bool keeps_order() const {
    if (terms_ == Terms::InAnyOrder) return true;
    for (size_t s = 0; s < changed_.nests.size(); ++s) {
      const StageId stage{func_, static_cast<int16_t>(s)};
      const bool is_atomic = new_nest(stage).concurrency == Concurrency::Atomic;
      if (old_nest(stage) == new_nest(stage) || (context_.device && is_atomic)) continue;
      if (!are_independent(context_, stage, new_nest(stage))) return false;
      const bool is_alike = are_alike(reduction_loops(context_, stage, new_nest(stage)),
                                      reduction_loops(context_, stage, old_nest(stage)));
      if (!is_alike && !moves::keeps_order(context_, stage, new_nest(stage))) return false;
    }
    return true;
  }

  // ---- L7 ----

  // Lanes of terms that make the chains of a long sum short stay.
  bool keeps_short_chains() const {
    for (size_t s = 0; s < changed_.nests.size(); ++s) {
      const StageId stage{func_, static_cast<int16_t>(s)};
      if (has_lanes_of_terms(stage, old_nest(stage)) &&
          !has_lanes_of_terms(stage, new_nest(stage)) && is_long_sum(stage, context_.sizes))
        return false;
    }
    return true;
  }
  bool has_lanes_of_terms(StageId stage, const Nest& nest) const {
    const std::optional<size_t> lanes = vector_loop(nest);
    return lanes && is_reduction(context_, stage, nest.loops[*lanes].iterator);
  }

  // ---- L11 ----

  // Loops that stages share stay, and so do the places of Funcs that share theirs.
  bool keeps_shared_loops() const {
    for (const FuncId id : bound_) {
      const bool is_own = id == func_;
      for (size_t s = 0; s < before_.of(id).nests.size(); ++s) {
        const Nest& nest = before_.of(id).nests[s];
        if (!nest.shared_with) continue;
        const auto [host, depth] = *nest.shared_with;
        if (!is_own && host.func != func_) continue;
        if (is_own != (host.func == func_) && is_moved_) return false;
        const StageId stage{func_, static_cast<int16_t>(s)};
        if (is_own && !(changed_.nests[s].shared_with == nest.shared_with)) continue;
        if (is_own && !has_equal_loops(nest, new_nest(stage), depth)) return false;
        if (host.func == func_ && !has_equal_loops(old_nest(host), new_nest(host), depth))
          return false;
      }
    }
    return true;
  }

  // ---- L4, L9 ----

  // The loop of this Func in which another one is computed, perhaps inside of loops of others.
  std::optional<LoopRef> place_of(FuncId guest) const {
    const Level* level = &before_.of(guest).placement.compute;
    while (level->kind == Kind::At) {
      if (is_at(*level, func_)) return level->loop;
      level = &before_.of(level->loop.stage.func).placement.compute;
    }
    return std::nullopt;
  }

  // Whether the Func reads one with a window, perhaps through inlined Funcs.
  bool reads_window() const {
    for (size_t id = 0; id < before_.funcs.size(); ++id) {
      const auto other = static_cast<FuncId>(id);
      if (other == func_ || !has_window(before_.of(other))) continue;
      const std::vector<StageId> readers = all_readers(before_, context_, other);
      if (std::ranges::find(readers, func_, &StageId::func) != readers.end()) return true;
    }
    return false;
  }

  bool keeps_region(FuncId guest) const {
    const std::optional<LoopRef> place = place_of(guest);
    if (!place) return true;
    const FuncPlan& other = before_.of(guest);
    if (is_moved_) return !has_window(other) && runs_at_any_size(other, context_, guest);
    const Nest &old = old_nest(place->stage), &nest = new_nest(place->stage);
    const auto depth = new_depth(*place);
    if (!depth) return false;
    if (has_window(other) && !has_equal_loops(old, nest, place->depth)) return false;
    const size_t iterators = context_.accesses.stage(place->stage).iterators.size();
    for (int i = 0; i < static_cast<int>(iterators); ++i) {
      if (span(old, place->depth, i) != span(nest, *depth, i))
        return runs_at_any_size(other, context_, guest);
    }
    return true;
  }

  // ---- references ----

  // Levels and shared loops of another Func that refer to loops of this one.
  bool renumber(Plan& plan, FuncId guest) const {
    const auto& [compute, store, hoist] = plan.of(guest).placement;
    const bool refers = is_at(compute, func_) || is_at(store, func_) || is_at(hoist, func_) ||
                        std::ranges::any_of(plan.of(guest).nests, [&](const Nest& nest) {
                          return nest.shared_with && nest.shared_with->stage.func == func_;
                        });
    if (!refers) return true;
    FuncPlan other = plan.of(guest);
    bool is_there = true;
    const auto follow = [&](LoopRef& loop) {
      const auto depth = new_depth(loop);
      is_there = is_there && depth;
      if (depth) loop.depth = *depth;
    };
    for (Level* level :
         {&other.placement.compute, &other.placement.store, &other.placement.hoist}) {
      if (!is_at(*level, func_)) continue;
      if (level->in_each_stage && !(changed_.nests == before().nests)) return false;
      follow(level->loop);
      const std::optional<LoopRef>& shared = new_nest(level->loop.stage).shared_with;
      const bool is_owned = shared && shared->stage.func != func_;
      if (is_owned && level->loop.depth <= shared->depth) level->loop.stage = shared->stage;
    }
    for (Nest& nest : other.nests) {
      if (nest.shared_with && nest.shared_with->stage.func == func_) follow(*nest.shared_with);
    }
    if (is_there && !(other == plan.of(guest)))
      plan.funcs[static_cast<size_t>(guest)] = std::make_shared<FuncPlan>(std::move(other));
    return is_there;
  }
};

}  // namespace

double product_of(const std::vector<int64_t>& extents) {
  double product = 1;
  for (const int64_t extent : extents) product *= static_cast<double>(extent);
  return product;
}

double computed_elements(const Plan& plan, const Context& context, const Level& level,
                         const std::vector<int64_t>& box) {
  const auto [stage, depth] = level.loop;
  const Cover extents = whole_cover(stage, context.sizes);
  double computed = product_of(box);
  for (size_t d = 0; d <= static_cast<size_t>(depth); ++d)
    computed *= static_cast<double>(trips(extents, plan.nest(stage), d));
  return computed;
}

FuncPlan moved_inside(FuncPlan plan, const Placement& placement) {
  plan.placement = placement;
  plan.storage.folds.clear();
  for (Nest& nest : plan.nests) {
    for (Loop& loop : nest.loops)
      if (loop.kind == ForType::Parallel) loop.kind = ForType::Serial;
  }
  return plan;
}

bool runs_at_any_size(const FuncPlan& plan, const Context& context, FuncId func) {
  if (plan.opacity != Opacity::None ||
      (plan.storage.memory != MemoryType::Auto && plan.storage.memory != MemoryType::Heap))
    return false;
  for (size_t s = 0; s < plan.nests.size(); ++s) {
    const StageId stage{func, static_cast<int16_t>(s)};
    const auto iterators = static_cast<int>(context.accesses.stage(stage).iterators.size());
    for (const Loop& loop : plan.nests[s].loops) {
      if (loop.kind == ForType::Serial || loop.kind == ForType::Parallel) continue;
      if (outer_step(plan.nests[s], loop.iterator, loop.step) > 0) continue;
      const bool is_own = loop.iterator >= 0 && loop.iterator < iterators;
      if (!is_own || !is_reduction(context, stage, loop.iterator)) return false;
    }
  }
  return true;
}

bool keeps_order(const Context& context, StageId stage, const Nest& nest) {
  const std::vector<LoopStep> loops = reduction_loops(context, stage, nest);
  return std::ranges::all_of(context.dependences.of(stage).all(),
                             [&](const Dependence& d) { return keeps(d, loops); });
}

bool has_window(const FuncPlan& func) {
  const auto& [compute, store, hoist] = func.placement;
  if (func.opacity != Opacity::None) return compute.kind != Kind::Root;
  return !func.storage.folds.empty() || hoist.kind != Kind::Undecided ||
         (store.kind != Kind::Undecided && !(store == compute));
}

bool stays_in_place(const Context& context, FuncId func) {
  for (const StageNode& stage : context.accesses.func(func).stages) {
    const auto is_pure = [&](const IndexForm& form) {
      return form.is_affine() && form.terms.size() == 1 &&
             !is_reduction(context, stage.id, form.terms[0].iterator);
    };
    if (!std::ranges::all_of(stage.write.index, is_pure)) return false;
    for (const Access& read : stage.reads) {
      if (read.of == func && read.index != stage.write.index) return false;
    }
  }
  return true;
}

bool may_run_in_loops(const Plan& plan, const Context& context, FuncId func) {
  const std::vector<StageId> readers = all_readers(plan, context, func);
  const auto is_known = [&](StageId reader) {
    return plan.of(reader.func).opacity == Opacity::None;
  };
  return is_editable(plan, func) && !is_output(*plan.program, func) &&
         std::ranges::all_of(readers, is_known) && has_bounded_region(plan, context, func);
}

std::optional<Plan> with_func(const Plan& plan, FuncId func, FuncPlan changed,
                              const Context& context, Terms terms) {
  if (changed == plan.of(func)) return std::nullopt;
  return FuncChange(plan, func, std::move(changed), context, terms).run();
}

std::vector<Plan> with_nests(const Plan& plan, FuncId func, const Context& context,
                             std::vector<Nest> (*nests)(const StageLoops&), Terms terms) {
  std::vector<Plan> plans;
  if (!has_loops(plan, func)) return plans;
  for (const StageNode& node : context.accesses.func(func).stages) {
    const StageLoops loops{plan, context, node.id, plan.nest(node.id),
                           loop_extents(plan, context, node.id)};
    for (Nest& nest : nests(loops)) {
      FuncPlan changed = plan.of(func);
      changed.nests[static_cast<size_t>(node.id.stage)] = std::move(nest);
      add(plans, with_func(plan, func, std::move(changed), context, terms));
    }
  }
  return plans;
}

void add(std::vector<Plan>& plans, std::optional<Plan> plan) {
  if (plan && std::ranges::find(plans, *plan) == plans.end()) plans.push_back(std::move(*plan));
}

void add_placed(std::vector<Plan>& plans, const Plan& plan, FuncId func, const Placement& placement,
                const std::vector<int64_t>& box, const Context& context) {
  FuncPlan changed = moved_inside(plan.of(func), placement);
  const bool has_own_loops = has_loops(plan, func) && runs_at_any_size(changed, context, func);
  if (has_own_loops) add(plans, with_func(plan, func, changed, context));
  run_along_rows(changed, plan, context, func, box, lanes_for(plan, {func, 0}, INT64_MAX) / 2);
  add(plans, with_func(plan, func, std::move(changed), context));
}

}  // namespace retrograde::planning::moves

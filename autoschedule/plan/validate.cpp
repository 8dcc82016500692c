// validate.cpp -- the invariants of plans.
//
//   P1  The loops and fused loops of an iterator have different steps, the smallest of which is 1. A step in blocks is a
//       multiple of the next smaller one. The smallest step has no tail.
//   P2  A Func that is computed in a loop is read inside of that loop only, also through inlined Funcs.
//   P3  The loop where a Func is stored encloses the one where it is computed; none between them is parallel.
//   P4  A nest has at most one loop over vector lanes. Its extent is known if it runs over a reduction variable, and
//       nothing is computed inside of it.
//   P5  Loops that carry a dependence are serial and keep their order, unless the update commutes or is atomic. The
//       rules of directives decide it (graph/directives/iteration_order.h).
//   P7  Stages that share loops can run together (sharing.h).
//
// Not checked: what depends on the regions that loops access, such as whether a window holds all rows that are read
// again (P6).
#include <algorithm>

#include "autoschedule/plan/nest.h"
#include "autoschedule/plan/plan.h"
#include "autoschedule/plan/readers.h"
#include "autoschedule/plan/sharing.h"
#include "diagnostics/error.h"
#include "graph/definitions/define.h"
#include "ir/build.h"

namespace retrograde::planning {

namespace {

using graph::FuncContents;

bool is_over_lanes(ForType kind) { return kind == ForType::Vectorized || kind == ForType::GpuLane; }
bool is_parallel(ForType kind) {
  return kind == ForType::Parallel || kind == ForType::GpuBlock || kind == ForType::GpuThread;
}

class PlanChecker {
 public:
  // `before`: null, or a plan that keeps the invariants.
  PlanChecker(const Plan& plan, const Plan* before) : plan_(plan), before_(before) {}

  std::string run() {
    check_structure();
    if (broken_.empty()) check_order();
    return broken_;
  }
  std::string check_structure() {
    for (size_t f = 0; f < plan_.funcs.size(); ++f) {
      const auto id = static_cast<FuncId>(f);
      if (is_changed(id) || is_bound(plan_.of(id))) bound_.push_back(id);
    }
    for_each_changed([&](StageId stage) { check_steps(stage); });
    for (const FuncId id : bound_) check_levels(id);
    if (broken_.empty()) broken_ = broken_sharing(plan_, before_);
    if (!broken_.empty()) return broken_;
    const Readers readers(plan_);
    for (const FuncId id : bound_) check_reads(id, readers);
    for (const FuncId id : bound_) check_storage(id);
    for_each_changed([&](StageId stage) { check_lanes(stage); });
    for (const FuncId id : bound_) check_outside_of_lanes(id);
    return broken_;
  }

 private:
  using Kind = Level::Kind;
  const Plan& plan_;
  const Plan* before_;
  std::string broken_;
  std::vector<FuncId> bound_;  // the Funcs that changed, and those that loops of others concern

  template <typename... Parts>
  void breaks(const Parts&... parts) {
    if (broken_.empty()) broken_ = text(parts...);
  }
  bool is_changed(FuncId id) const {
    const auto i = static_cast<size_t>(id);
    return !before_ || plan_.funcs[i] != before_->funcs[i];
  }
  template <typename F>
  void for_each_changed(const F& f) const {
    for (const FuncId id : bound_) {
      for (size_t s = 0; s < plan_.of(id).nests.size() && is_changed(id); ++s)
        f(StageId{id, static_cast<int16_t>(s)});
    }
  }
  const FuncContents& func(FuncId id) const {
    return *plan_.program->funcs[static_cast<size_t>(id)];
  }
  std::string name(StageId stage) const {
    return quoted(stage_name(func(stage.func), stage.stage));
  }
  std::string loop_text(const LoopRef& loop) const { return quoted(to_text(plan_, loop)); }

  // ---- P1 ----

  void check_steps(StageId stage) {
    const Nest& nest = plan_.nest(stage);
    const std::vector<std::string>& names = iterators_of(*plan_.program, stage);
    const int count = static_cast<int>(names.size() + nest.fusions.size());
    for (size_t d = 0; d < nest.loops.size(); ++d) check_iterator(stage, d, count);
    for (int i = 0; i < count && broken_.empty(); ++i) {
      check_parts(parts_of(nest, i), [&] {
        const auto own = static_cast<size_t>(i);
        return text(own < names.size() ? quoted(names[own]) : "two loops that run as one", " of ",
                    name(stage));
      });
    }
  }
  void check_iterator(StageId stage, size_t depth, int count) {
    const Loop& loop = plan_.nest(stage).loops[depth];
    if (loop.iterator < once || loop.iterator >= count)
      breaks("P1: loop ", depth, " of ", name(stage), " runs over no iterator of the stage");
    if (loop.iterator == once && (depth > 0 || loop.step != 1 || loop.kind != ForType::GpuBlock))
      breaks("P1: loop ", depth, " of ", name(stage),
             " runs once, but is not the outermost one over blocks of a device");
  }
  // `what`: gives the name of the iterator.
  template <typename Name>
  void check_parts(const std::vector<Part>& parts, const Name& what) {
    if (parts.empty()) return breaks("P1: no loop runs over ", what());
    for (size_t i = 0; i + 1 < parts.size(); ++i) {
      if (parts[i].step == parts[i + 1].step)
        breaks("P1: two loops over ", what(), " have step ", parts[i].step, "; steps decrease");
      if (parts[i].in_blocks && parts[i].step % parts[i + 1].step != 0)
        breaks("P1: step ", parts[i].step, " over ", what(), " is in blocks of ", parts[i + 1].step,
               ", which do not divide it");
    }
    const Part& last = parts.back();
    if (last.step != 1) breaks("P1: the smallest step over ", what(), " is ", last.step, ", not 1");
    if (last.in_blocks || last.tail != TailStrategy::Auto)
      breaks("P1: the loop over ", what(), " with step 1 has a tail");
  }

  // ---- levels exist ----

  void check_levels(FuncId id) {
    const Placement& placement = plan_.of(id).placement;
    for (const Level* level : {&placement.compute, &placement.store, &placement.hoist}) {
      if (level->kind == Kind::At && !exists(level->loop))
        breaks("P2: ", quoted(func(id).name), " is placed at a loop that does not exist");
    }
    for (const Nest& nest : plan_.of(id).nests) {
      if (nest.shared_with && !exists(*nest.shared_with))
        breaks("P2: ", quoted(func(id).name), " shares a loop that does not exist");
    }
  }
  bool exists(const LoopRef& loop) const {
    const auto [id, stage] = loop.stage;
    if (id < 0 || id >= static_cast<FuncId>(plan_.funcs.size())) return false;
    if (stage < 0 || stage >= func(id).stage_count()) return false;
    return loop.depth >= around_all_loops && loop.depth < loop_count(loop.stage);
  }
  int loop_count(StageId stage) const {
    const bool is_opaque = plan_.of(stage.func).opacity != Opacity::None;
    return static_cast<int>(is_opaque ? func(stage.func).stage(stage.stage).schedule.dims.size()
                                      : plan_.nest(stage).loops.size());
  }

  // ---- P2 ----

  void check_reads(FuncId id, const Readers& readers) {
    const Level& compute = plan_.of(id).placement.compute;
    if (compute.kind != Kind::At) return;
    const std::optional<StageId> outside = readers.find_outside(id, compute);
    if (outside)
      breaks("P2: ", quoted(func(id).name), " is computed at ", loop_text(compute.loop), ", but ",
             name(*outside), " reads it outside of that loop");
  }
  // ---- P3 ----

  void check_storage(FuncId id) {
    const auto& [compute, store, hoist] = plan_.of(id).placement;
    if (store.kind == Kind::Undecided || !broken_.empty()) return;
    LoopRef at = compute.loop;
    bool is_at_loop = compute.kind == Kind::At;
    const bool to_root = store.kind == Kind::Root;
    while (is_at_loop) {
      const bool is_last = !to_root && at.stage == store.loop.stage;
      const int end = is_last ? store.loop.depth : -1;
      for (int d = at.depth; d > end; --d) check_serial(id, {at.stage, static_cast<int16_t>(d)});
      if (is_last && at.depth >= store.loop.depth) return;
      const Level& outer = plan_.of(at.stage.func).placement.compute;
      is_at_loop = outer.kind == Kind::At && !is_last;
      at = outer.loop;
    }
    if (!to_root)
      breaks("P3: ", quoted(func(id).name), " is stored at ", loop_text(store.loop),
             ", which is not around the place where it is computed");
  }
  void check_serial(FuncId id, const LoopRef& loop) {
    if (plan_.of(loop.stage.func).opacity != Opacity::None) return;
    if (is_parallel(plan_.nest(loop.stage).loops[static_cast<size_t>(loop.depth)].kind))
      breaks("P3: between the loops where ", quoted(func(id).name), " is stored and computed, ",
             loop_text(loop), " runs in parallel");
  }

  // ---- P4 ----

  void check_lanes(StageId stage) {
    const Nest& nest = plan_.nest(stage);
    int count = 0;
    for (size_t d = 0; d < nest.loops.size(); ++d) {
      const Loop& loop = nest.loops[d];
      if (!is_over_lanes(loop.kind)) continue;
      const LoopRef ref{stage, static_cast<int16_t>(d)};
      if (++count > 1)
        breaks("P4: ", loop_text(ref), " is the second loop over lanes of ", name(stage));
      if (!has_known_extent(stage, loop))
        breaks("P4: ", loop_text(ref), " runs over lanes, but its extent is not constant");
    }
  }
  // Extents of pure variables are known only where regions are.
  bool has_known_extent(StageId stage, const Loop& loop) const {
    if (loop.iterator == once || next_larger(plan_.nest(stage), loop.iterator, loop.step))
      return true;
    const std::vector<std::string>& names = iterators_of(*plan_.program, stage);
    const auto i = static_cast<size_t>(loop.iterator);
    const auto& rvars = func(stage.func).stage(stage.stage).rvars;
    const auto rvar =
        std::ranges::find(rvars, i < names.size() ? names[i] : "", &graph::ReductionVariable::var);
    return rvar == rvars.end() || as_const_int(rvar->extent).has_value();
  }

  void check_outside_of_lanes(FuncId id) {
    const Level& compute = plan_.of(id).placement.compute;
    if (compute.kind != Kind::At || plan_.of(compute.loop.stage.func).opacity != Opacity::None)
      return;
    const Nest& host = plan_.nest(compute.loop.stage);
    for (int d = 0; d <= compute.loop.depth; ++d) {
      if (is_over_lanes(host.loops[static_cast<size_t>(d)].kind))
        breaks("P4: ", quoted(func(id).name), " is computed at ", loop_text(compute.loop),
               ", inside of the loop over lanes ",
               loop_text({compute.loop.stage, static_cast<int16_t>(d)}));
    }
  }

  // ---- P5 ----

  void check_order() {
    try {
      emit_plan(plan_);
    } catch (const CompileError& e) {
      breaks("P5: ", e.what());
    }
  }
};

}  // namespace

std::string broken_invariant(const Plan& plan) { return PlanChecker(plan, nullptr).run(); }
std::string broken_structure(const Plan& plan, const Plan& before) {
  return PlanChecker(plan, &before).check_structure();
}

void validate(const Plan& plan) {
  const std::string broken = broken_invariant(plan);
  RETROGRADE_ASSERT(broken.empty(), "a plan keeps its invariants. ", broken);
}

}  // namespace retrograde::planning

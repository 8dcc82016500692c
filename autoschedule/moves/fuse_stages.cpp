// fuse_stages -- the first update of a Func runs in the outer loops of the pure definition, so that a tile of the result
// stays near from its start to its end; or each stage has its own loops again.
//
//   sum  root                                                    sum  root
//     .0  c, y, x                                                  .0  c:4, y, x:32, unroll c, unroll x:16, vector x
//     .1  c:4, y, x:32, r.x, unroll c, unroll x:16, vector x  =>   .1  shared with sum.0/x:32  c:4, y, x:32, r.x, ...
//
//   rows  root                                                   rows  root
//     .0  parallel y, x:16, vector x                               .0  parallel y:8, y, x:16, vector x
//     .1  parallel y:8, r.x, vector y                        =>    .1  shared with rows.0/y:8  y:8, r.x, vector y
//
// Legal: L11: the pure definition gets the loops of the update without those of its reduction, or the outermost ones of
// these if the update has not all dimensions. Iterations of pure loops touch no elements of others, so none of them runs
// too early. No Func is computed in loops that would be shared.
#include <algorithm>
#include <optional>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

bool hosts_a_func(const Plan& plan, FuncId func) {
  return std::ranges::any_of(plan.funcs, [&](const auto& other) {
    const Level& level = other->placement.compute;
    return level.kind == Level::Kind::At && level.loop.stage.func == func;
  });
}

// The loops of a pure definition inside of the first `shared` loops of an update; nullopt if one is in the way.
std::optional<Nest> inside_of(const Nest& update, size_t shared, const Nest& own,
                              const std::vector<Iterator>& iterators) {
  Nest nest = own;
  for (Loop& loop : nest.loops)
    if (runs_at_once(loop.kind)) loop.kind = ForType::Serial;
  for (size_t d = 0; d < shared; ++d) {
    const Loop& outer = update.loops[d];
    if (static_cast<size_t>(outer.iterator) >= iterators.size()) return std::nullopt;
    const int dimension = iterators[static_cast<size_t>(outer.iterator)].dimension;
    const auto is_larger = [&](const Loop& loop) {
      return loop.iterator == dimension && loop.step > outer.step;
    };
    if (std::any_of(nest.loops.begin() + static_cast<std::ptrdiff_t>(d), nest.loops.end(),
                    is_larger))
      return std::nullopt;
    if (const auto same = find_loop(nest, dimension, outer.step)) {
      if (*same < d || *same >= body_depth(nest)) return std::nullopt;
      const auto first = nest.loops.begin();
      std::rotate(first + static_cast<std::ptrdiff_t>(d),
                  first + static_cast<std::ptrdiff_t>(*same),
                  first + static_cast<std::ptrdiff_t>(*same + 1));
      nest.loops[d].kind = outer.kind;
    } else {
      insert_step(nest, dimension, outer.step, d, outer.kind);
    }
  }
  return nest;
}

}  // namespace

std::vector<Plan> fuse_stages(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  if (!has_loops(plan, func) || plan.of(func).nests.size() < 2 || hosts_a_func(plan, func))
    return plans;
  const StageId update{func, 1};
  FuncPlan changed = plan.of(func);
  Nest &first = changed.nests[0], &nest = changed.nests[1];
  if (nest.shared_with || shared_loops(plan, {func, 0}) > 0) {
    if (nest.shared_with && nest.shared_with->stage == StageId{func, 0}) {
      nest.shared_with.reset();
      add(plans, with_func(plan, func, std::move(changed), context));
    }
    return plans;
  }
  const auto adds_up = [&](const Loop& loop) {
    return is_reduction(context, update, loop.iterator);
  };
  const auto pure =
      static_cast<size_t>(std::ranges::find_if(nest.loops, adds_up) - nest.loops.begin());
  const size_t shared = std::min(pure, body_depth(nest));
  const bool has_all_dimensions =
      context.accesses.stage({func, 0}).iterators.size() ==
      static_cast<size_t>(std::ranges::count(context.accesses.stage(update).iterators,
                                             Iterator::Kind::Pure, &Iterator::kind));
  if (shared == 0 || first.concurrency != Concurrency::Independent) return plans;
  if (has_all_dimensions) {
    first.loops = nest.loops;
    std::erase_if(first.loops, adds_up);
  } else {
    const auto inner = inside_of(nest, shared, first, context.accesses.stage(update).iterators);
    if (!inner) return plans;
    first = *inner;
  }
  nest.shared_with = LoopRef{{func, 0}, static_cast<int16_t>(shared - 1)};
  add(plans, with_func(plan, func, std::move(changed), context));
  return plans;
}

}  // namespace retrograde::planning::moves

// share_loops -- an update runs in the loops of an update of another Func, over the same points, so that what both read is
// loaded once; or in its own again.
//
//   du  root                                      du  root
//     .1  parallel y, x:16, r.c, vector x           .1  parallel y, x:16, r.c, vector x
//   dv  root                                =>    dv  root
//     .1  y, x:16, unroll r.c, vector x             .1  shared with du.1/r.c  parallel y, x:16, r.c, vector x
//
// Legal: L1, L2: both keep the order of their reductions in the loops that they get; L3: neither Func depends on the other,
// and both are at root; L11: the loops are equal, and no Func is computed in those that are given up.
#include <algorithm>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

constexpr size_t most_partners = 2;

bool is_at_root(const Plan& plan, FuncId func) {
  return plan.of(func).placement.compute.kind == Level::Kind::Root;
}

// Whether the stages run over the same points: iterators of the same extents, whose numbers are the same.
bool run_alike(const Context& context, const StageNode& a, const StageNode& b) {
  const auto extent = [&](const StageNode& stage, size_t i) {
    const Extent own = context.sizes.of(stage.id, static_cast<int>(i));
    return std::tuple(own.estimate, own.low, own.high);
  };
  if (a.iterators.size() != b.iterators.size()) return false;
  for (size_t i = 0; i < a.iterators.size(); ++i) {
    if (a.iterators[i].kind != b.iterators[i].kind || extent(a, i) != extent(b, i)) return false;
  }
  return true;
}

// Whether both read one image or Func, along the same iterators.
bool read_alike(const StageNode& a, const StageNode& b) {
  return std::ranges::any_of(a.reads, [&](const Access& read) {
    return read.of != a.id.func && std::ranges::any_of(b.reads, [&](const Access& other) {
             return other.of == read.of && other.image == read.image &&
                    other.moved_by() == read.moved_by();
           });
  });
}

bool is_partner(const Plan& plan, const Context& context, FuncId func, FuncId other) {
  if (other == func || !has_loops(plan, other) || !is_at_root(plan, other)) return false;
  const std::vector<StageNode>&own = context.accesses.func(func).stages,
        &others = context.accesses.func(other).stages;
  return own.size() == others.size() && run_alike(context, own.back(), others.back()) &&
         read_alike(own.back(), others.back());
}

}  // namespace

std::vector<Plan> share_loops(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  const bool is_update = plan.of(func).nests.size() > 1;
  if (!is_update || !has_loops(plan, func) || !is_at_root(plan, func)) return plans;
  const StageId last{func, static_cast<int16_t>(plan.of(func).nests.size() - 1)};
  FuncPlan changed = plan.of(func);
  Nest& nest = changed.nests.back();
  if (nest.shared_with && nest.shared_with->stage.func != func) {
    nest.shared_with.reset();
    add(plans, with_func(plan, func, std::move(changed), context));
    return plans;
  }
  if (shared_loops(plan, last) > (nest.shared_with ? size_t(nest.shared_with->depth) + 1 : 0))
    return plans;
  for (FuncId other = 0; other < static_cast<FuncId>(plan.funcs.size()); ++other) {
    if (plans.size() == most_partners || !is_partner(plan, context, func, other)) continue;
    const StageId host{other, last.stage};
    nest = plan.nest(host);
    if (nest.concurrency != Concurrency::Independent || body_depth(nest) == 0) continue;
    nest.shared_with = LoopRef{host, static_cast<int16_t>(body_depth(nest) - 1)};
    add(plans, with_func(plan, func, changed, context));
  }
  return plans;
}

}  // namespace retrograde::planning::moves

// compute_in_thread -- a thread computes an element of a Func, updates included, when it needs it.
//
//   block(x, b) += e(x, 256 b + r);  mean(x) += block(x, b)
//
//   block  root  ...                                   =>     block  at mean.1/b  ...
//   mean.1 root  block x:128, thread x, b                     mean.1 root  block x:128, thread x, b
//
// It needs no memory and no launch. Legal: L3, L8; one stage alone reads the Func, a single element at a time.
#include <algorithm>

#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/covers.h"
#include "autoschedule/plan/nest.h"

namespace retrograde::planning::moves {

std::vector<Plan> compute_in_thread(const Plan& plan, FuncId func, const Context& context) {
  if (!context.device || plan.of(func).placement.compute.kind != Level::Kind::Root ||
      !is_editable(plan, func, context) || is_output(*plan.program, func) ||
      !has_bounded_region(plan, context, func))
    return {};
  std::vector<StageId> hosts = all_readers(plan, context, func);
  std::erase_if(hosts, [&](StageId reader) { return is_inlined(plan, reader.func); });
  if (hosts.size() != 1 || plan.of(hosts[0].func).opacity != Opacity::None) return {};
  const Nest& host = plan.nest(hosts[0]);
  // A loop over blocks has no threads inside, and one that runs once is around the kernel.
  if (!is_kernel(host) || host.loops.back().kind == ForType::GpuBlock) return {};
  const LoopRef innermost{hosts[0], static_cast<int16_t>(host.loops.size() - 1)};
  FuncPlan changed = plan.of(func);
  changed.placement = {};
  changed.placement.compute = {Level::Kind::At, innermost};
  if (product_of(Covers(plan, context.sizes).box(func, changed.placement.compute)) != 1) return {};
  for (const StageNode& node : context.accesses.func(func).stages) {
    if (!may_be_kernel(plan, context, node.id)) return {};
    const graph::FuncContents& f = *plan.program->funcs[static_cast<size_t>(func)];
    changed.nests[static_cast<size_t>(node.id.stage)] = loops_of_definition(f, node.id.stage);
  }
  std::vector<Plan> plans;
  add(plans, with_func(plan, func, std::move(changed), context));
  return plans;
}

}  // namespace retrograde::planning::moves

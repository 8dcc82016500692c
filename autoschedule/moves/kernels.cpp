// kernels -- other shapes of the blocks of a kernel.
//
//   block y:4, block x:32, thread y, thread x     =>     block y, block x:128, thread x
//                                                 =>     block y:8, block x:16, thread y, thread x
//                                                 =>     block x:4, block y:32, thread x, thread y
//
// Legal: L1, L6, L10. Threads of a warp run along the first iterator: the one whose elements lie together, or another one along
// which more of what is read does. `root` makes the first kernel of each stage.
#include <algorithm>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

std::vector<KernelShape> shapes_of(const Context& context, StageId stage) {
  const int64_t warp = context.device->warp_size, all = context.device->block_threads();
  std::vector<KernelShape> result;
  for (const int64_t along : {warp, all, warp / 2}) result.push_back({along, -1});
  const auto count = static_cast<int>(context.accesses.stage(stage).iterators.size());
  for (int i = 0; i < count; ++i) {
    if (is_free(context, stage, i) && lanes_together(context, stage, i) > 0)
      result.push_back({warp, static_cast<int16_t>(i)});
  }
  return result;
}

}  // namespace

std::vector<Plan> kernels(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  const bool is_at_root = plan.of(func).placement.compute.kind == Level::Kind::Root;
  if (!context.device || !is_at_root || !is_editable(plan, func, context)) return plans;
  for (const StageNode& node : context.accesses.func(func).stages) {
    if (!may_be_kernel(plan, context, node.id)) continue;
    for (const KernelShape& shape : shapes_of(context, node.id)) {
      FuncPlan changed = plan.of(func);
      changed.nests[static_cast<size_t>(node.id.stage)] =
          kernel_loops(plan, context, node.id, changed.storage.order, shape);
      add(plans, with_func(plan, func, std::move(changed), context));
    }
  }
  return plans;
}

}  // namespace retrograde::planning::moves

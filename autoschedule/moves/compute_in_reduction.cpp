// compute_in_reduction -- a Func is computed for each term of the sums of its only consumer, of which all in a strip of rows
// take their terms together.
//
//   diff  root  d, y, x:16, vector x          sum   root
//   sum   root                          =>      .1  parallel y:8, r.d, y, x:16, vector x
//     .1  parallel y, x:16, r.d, vector x     diff  at sum.1/r.d  y, x:16, vector x
//
// Legal: L1, L2: loops over the reduction keep their order and pure loops move inside; L3, L4, L5, L8.
// Method: for each cache of a core, the highest strips of which the Func fits into it.
#include <algorithm>
#include <bit>
#include <functional>

#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/covers.h"

namespace retrograde::planning::moves {

namespace {

// The update at root that alone reads the Func, perhaps through inlined ones, and shares no loops with other Funcs.
std::optional<StageId> only_sum(const Plan& plan, const Context& context, FuncId func) {
  const std::optional<StageId> found = only_reader(plan, context, func);
  if (!found || found->func == func || !has_loops(plan, found->func) ||
      plan.of(found->func).placement.compute.kind != Level::Kind::Root)
    return std::nullopt;
  const std::optional<LoopRef>& host = plan.nest(*found).shared_with;
  const bool is_shared = host ? host->stage.func != found->func : shared_loops(plan, *found) > 0;
  return is_shared ? std::nullopt : found;
}

// One loop for each iterator: those of the reduction, the others along rows as they are stored, and the lanes. nullopt: there
// is no reduction, no row or no lane.
struct SumLoops {
  Nest nest;
  size_t rows = 0;  // the depth of the outermost pure loop
};
std::optional<SumLoops> reduction_outside(const StageLoops& sum) {
  const auto& [plan, context, stage, before, extents] = sum;
  const std::optional<size_t> lanes = vector_loop(before);
  if (!lanes || *lanes + 1 < before.loops.size()) return std::nullopt;
  const int lane = before.loops[*lanes].iterator;
  if (is_reduction(context, stage, lane)) return std::nullopt;
  SumLoops result{before};
  Nest& nest = result.nest;
  nest.shared_with.reset();
  for (size_t d = *lanes; d-- > 0;) {
    const Loop& loop = nest.loops[d];
    if (outer_step(nest, loop.iterator, loop.step) > 0) drop_loop(nest, d);
  }
  for (Loop& loop : nest.loops)
    if (loop.kind != ForType::Vectorized) loop.kind = ForType::Serial;
  const std::vector<int16_t>& order = plan.of(stage.func).storage.order;
  const std::vector<Iterator>& iterators = context.accesses.stage(stage).iterators;
  const auto rank = [&](const Loop& loop) {
    const Iterator& i = iterators[static_cast<size_t>(loop.iterator)];
    const bool adds_up = is_reduction(context, stage, loop.iterator);
    return adds_up ? 0 : order.end() - std::ranges::find(order, i.dimension);
  };
  std::ranges::stable_sort(nest.loops.begin(), nest.loops.end() - 1, std::less(), rank);
  while (is_reduction(context, stage, nest.loops[result.rows].iterator)) ++result.rows;
  const bool has_rows = result.rows > 0 && nest.loops[result.rows].iterator != lane;
  return has_rows ? std::optional(std::move(result)) : std::nullopt;
}

}  // namespace

std::vector<Plan> compute_in_reduction(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  if (!has_loops(plan, func) || !may_run_in_loops(plan, context, func)) return plans;
  const std::optional<StageId> stage = only_sum(plan, context, func);
  if (!stage) return plans;
  const StageLoops sum{plan, context, *stage, plan.nest(*stage),
                       loop_extents(plan, context, *stage)};
  const std::optional<SumLoops> loops = reduction_outside(sum);
  if (!loops) return plans;
  const int rows = loops->nest.loops[loops->rows].iterator;
  const int64_t all = sum.extents[static_cast<size_t>(rows)];
  auto height = static_cast<int64_t>(std::bit_floor(
      static_cast<uint64_t>(std::max<int64_t>(all / context.machine.enough_tasks(), 1))));
  double elements = 1, bytes = 0;
  for (size_t d = 0; d < plan.of(func).storage.order.size(); ++d)
    elements *= static_cast<double>(std::max<int64_t>(context.sizes.of(func, d).estimate, 1));
  for (const Type& type : context.accesses.func(func).func->types) bytes += type.bytes();
  for (size_t level = Machine::near_cache + 1; level-- > 0;) {
    for (; height > 1; height /= 2) {
      Nest nest = loops->nest;
      insert_step(nest, rows, height, 0);
      run_in_parallel(nest, context, *stage);
      FuncPlan changed = plan.of(stage->func);
      changed.nests[static_cast<size_t>(stage->stage)] = std::move(nest);
      const std::optional<Plan> host = with_func(plan, stage->func, std::move(changed), context);
      if (!host) return plans;
      const Level inside{Level::Kind::At, {*stage, static_cast<int16_t>(loops->rows)}};
      const std::vector<int64_t> box = Covers(*host, context.sizes).box(func, inside);
      // The strip of the sums needs as much room.
      if (2 * product_of(box) * bytes > context.machine.levels[level].bytes) continue;
      if (computed_elements(*host, context, inside, box) <= most_recomputation * elements)
        add_placed(plans, *host, func, {inside, {}, {}}, box, context);
      break;
    }
  }
  return plans;
}

}  // namespace retrograde::planning::moves

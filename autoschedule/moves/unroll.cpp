// unroll -- the innermost loop around a stage's body becomes part of it, by a step or wholly.
//
//   y, r.x, x:16, vector x     =>     y, r.x, x:32, unroll x:16, vector x       and steps of 64 and 128
//   y, x:16, r.x, vector x     =>     y, x:16, unroll r.x, vector x             if r.x has few iterations
//   y, unroll r.x, vector x    =>     y, r.x, vector x
//
// Legal: L2, since the order of all iterations stays, and L4: the extent of an unrolled loop is a step outside of it, or
// a constant of the reduction; L5.
#include <algorithm>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

constexpr int64_t most_of_one_loop = 8;  // iterations that become part of the body

bool is_small_and_constant(const Context& context, StageId stage, const Nest& nest, size_t depth) {
  const Loop& loop = nest.loops[depth];
  const bool is_inside = outer_step(nest, loop.iterator, loop.step) > 0;
  const bool is_constant = is_inside || (is_reduction(context, stage, loop.iterator) &&
                                         context.sizes.of(stage, loop.iterator).is_constant());
  return is_constant && trips(context, stage, nest, depth) <= most_of_one_loop;
}

}  // namespace

std::vector<Plan> unroll(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  if (!has_loops(plan, func)) return plans;
  for (size_t s = 0; s < plan.of(func).nests.size(); ++s) {
    const StageId stage{func, static_cast<int16_t>(s)};
    const Nest& nest = plan.nest(stage);
    const size_t body = body_depth(nest);
    const int64_t work = operations(plan, context, stage);
    const auto give = [&](Nest changed) {
      if (work * copies(changed, context, stage) <= most_body_operations)
        add(plans, with_nest(plan, stage, std::move(changed), context));
    };
    if (body > 0 && nest.loops[body - 1].kind == ForType::Serial) {
      const size_t d = body - 1;
      Nest unrolled = nest;
      unrolled.loops[d].kind = ForType::Unrolled;
      if (is_small_and_constant(context, stage, nest, d)) {
        give(unrolled);
      } else {
        for (int64_t n = 2; n <= most_of_one_loop && 2 * n <= trips(context, stage, nest, d);
             n *= 2) {
          Nest part = unrolled;
          insert_step(part, nest.loops[d].iterator, n * nest.loops[d].step, d);
          give(std::move(part));
        }
      }
    }
    if (body == nest.loops.size() || nest.loops[body].kind != ForType::Unrolled) continue;
    Nest rolled = nest;
    rolled.loops[body].kind = ForType::Serial;
    const bool is_adjacent = body > 0 && nest.loops[body - 1].iterator == nest.loops[body].iterator;
    if (is_adjacent) drop_loop(rolled, body);
    give(std::move(rolled));
  }
  return plans;
}

}  // namespace retrograde::planning::moves

// parallelise -- which loops of a stage at root run in parallel.
//
//   y, x:16, vector x     =>     parallel y, x:16, vector x
//                         =>     parallel y:64, y, x:16, vector x       with as many rows as make enough tasks
//   parallel y, ...       =>     y, ...                                 too little work for a launch, or one thread
//
// Legal: L1, L6, since iterations of pure loops write different elements. A window that is stored outside of a loop is
// dropped with the plan if the loop becomes parallel (P3).
#include <algorithm>
#include <bit>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

std::vector<Plan> parallelise(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  if (!is_editable(plan, func) || plan.of(func).placement.compute.kind != Level::Kind::Root)
    return plans;
  const int64_t enough = context.machine.enough_tasks();
  for (size_t s = 0; s < plan.of(func).nests.size(); ++s) {
    const StageId stage{func, static_cast<int16_t>(s)};
    Nest serial = plan.nest(stage);
    for (Loop& loop : serial.loops) {
      if (loop.kind == ForType::Parallel) loop.kind = ForType::Serial;
    }
    Nest outermost = serial;
    run_in_parallel(outermost, context, stage);
    add(plans, with_nest(plan, stage, std::move(outermost), context));
    if (context.machine.threads > 1 && body_depth(serial) > 0 &&
        may_run_at_once(context, stage, serial, 0)) {
      Nest chunks = serial;
      const int16_t first = chunks.loops[0].iterator;
      if (chunks.loops.size() > 1 && chunks.loops[1].iterator == first) drop_loop(chunks, 1);
      const int64_t each = trips(whole_cover(stage, context.sizes), chunks, 0) / enough;
      if (each > 1) {
        const auto rows = static_cast<int64_t>(std::bit_floor(static_cast<uint64_t>(each)));
        insert_step(chunks, first, rows * chunks.loops[0].step, 0, ForType::Parallel);
        add(plans, with_nest(plan, stage, std::move(chunks), context));
      }
    }
    add(plans, with_nest(plan, stage, std::move(serial), context));
  }
  return plans;
}

}  // namespace retrograde::planning::moves

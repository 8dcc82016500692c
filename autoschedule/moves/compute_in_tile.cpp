// compute_in_tile -- a Func that is computed in tiles is computed and stored in loops over these tiles of its only consumer.
//
//   sum   root  c:4, y, x:32, r, unroll c, unroll x:16, vector x       out  root  c, y, x:16, vector x
//   =>    out   root  c:4, y, x:32, unroll c, unroll x:16, vector x
//         sum   at out/x:32
//   parts  root  c, k, r.y, vector k     =>     parts  root  c:4, r.y, k, unroll c, vector k      also with its reduction
//                                                                                                outside of other loops,
//                                                                                                or of some of the tile
//
// Legal: L1, L2: loops over the consumer's tile are pure, and those of its reduction keep their order; L3, L4, L5, L8.
#include <algorithm>
#include <cmath>
#include <functional>

#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/covers.h"

namespace retrograde::planning::moves {

namespace {

struct Side {
  int16_t iterator;  // of the consumer
  int64_t size;
};

// The stage that alone reads the Func, and not through others.
std::optional<StageId> direct_reader(const Plan& plan, const Context& context, FuncId func) {
  const std::vector<StageId> readers = all_readers(plan, context, func);
  if (readers.size() != 1 || !has_loops(plan, readers[0].func)) return std::nullopt;
  return readers[0];
}

// The steps of the Func's pure loops, outermost first, as steps of loops of the stage that reads it.
std::vector<Side> sides_of_tile(const Plan& plan, const Context& context, FuncId func,
                                const StageLoops& reader) {
  std::vector<Side> sides;
  const Nest& nest = plan.of(func).nests.back();
  const StageId stage{func, static_cast<int16_t>(plan.of(func).nests.size() - 1)};
  const StageNode& node = context.accesses.stage(reader.stage);
  const auto read = std::ranges::find(node.reads, func, &Access::of);
  for (const Loop& loop : nest.loops) {
    if (loop.step == 1 || is_reduction(context, stage, loop.iterator)) continue;
    const Iterator& own =
        context.accesses.stage(stage).iterators[static_cast<size_t>(loop.iterator)];
    const IndexForm& form = read->index[static_cast<size_t>(own.dimension)];
    if (!form.is_affine() || form.terms.size() != 1 || form.terms[0].coefficient != 1) continue;
    const int16_t iterator = form.terms[0].iterator;
    const int64_t points = reader.extents[static_cast<size_t>(iterator)];
    const bool is_new = std::ranges::find(sides, iterator, &Side::iterator) == sides.end();
    if (is_new && !is_reduction(context, reader.stage, iterator) && fits(loop.step, points))
      sides.push_back({iterator, loop.step});
  }
  return sides;
}

// The reader's loops around the tile and in it; nullopt if they have a tile already.
std::optional<Nest> tiled(const StageLoops& loops, const std::vector<Side>& sides) {
  const std::optional<size_t> lanes = vector_loop(loops.nest);
  const std::optional<LoopRef>& host = loops.nest.shared_with;
  const bool is_shared =
      host ? host->stage.func != loops.stage.func : shared_loops(loops.plan, loops.stage) > 0;
  if (is_shared || (lanes && body_depth(loops.nest) != *lanes)) return std::nullopt;
  Nest nest = loops.nest;
  nest.shared_with.reset();
  for (const auto& [iterator, size] : sides) {
    const bool has_lanes = lanes && loops.nest.loops[*lanes].iterator == iterator;
    const int64_t inner = has_lanes ? outer_step(nest, iterator, 1) : 1;
    if (size < inner || outer_step(nest, iterator, inner) > 0) return std::nullopt;
    if (size == inner) continue;
    nest.loops[*find_loop(nest, iterator, inner)].step = size;
    insert_step(nest, iterator, inner, nest.loops.size() - (lanes ? 1 : 0), ForType::Unrolled);
  }
  for (Loop& loop : nest.loops)
    if (loop.kind == ForType::Parallel) loop.kind = ForType::Serial;
  return nest;
}

void add_plan(std::vector<Plan>& plans, const StageLoops& reader, FuncId func, Nest nest) {
  const auto& [plan, context, stage, before, extents] = reader;
  if (body_operations(plan, context, stage, nest, extents) > most_body_operations) return;
  if (plan.of(stage.func).placement.compute.kind == Level::Kind::Root)
    run_in_parallel(nest, context, stage);
  const auto innermost = static_cast<int16_t>(body_depth(nest) - 1);
  FuncPlan changed = plan.of(stage.func);
  changed.nests[static_cast<size_t>(stage.stage)] = std::move(nest);
  const auto host = with_func(plan, stage.func, std::move(changed), context);
  if (!host) return;
  // The innermost loop in which the fewest elements are computed.
  Covers covers(*host, context.sizes);
  Level level{Level::Kind::At, {stage, innermost}}, best;
  double fewest = INFINITY;
  for (; level.loop.depth >= 0; --level.loop.depth) {
    const double computed = computed_elements(*host, context, level, covers.box(func, level));
    if (computed >= fewest) continue;
    fewest = computed;
    best = level;
  }
  add(plans, with_func(*host, func, moved_inside(plan.of(func), {best, {}, {}}), context));
}

void add_plans(std::vector<Plan>& plans, const Plan& plan, FuncId func, StageId stage,
               const Context& context) {
  const StageLoops reader{plan, context, stage, plan.nest(stage),
                          loop_extents(plan, context, stage)};
  const std::vector<Side> sides = sides_of_tile(plan, context, func, reader);
  if (sides.size() < 2) return;
  std::optional<Nest> nest = tiled(reader, sides);
  if (!nest || body_depth(*nest) == 0) return;
  add_plan(plans, reader, func, *nest);
  const auto add_ordered = [&](const auto& rank) {
    const auto body = nest->loops.begin() + static_cast<std::ptrdiff_t>(body_depth(*nest));
    std::ranges::stable_sort(nest->loops.begin(), body, std::less(), rank);
    add_plan(plans, reader, func, *nest);
  };
  const auto is_side = [&](const Loop& loop) {
    return loop.step > 1 && std::ranges::find(sides, loop.iterator, &Side::iterator) != sides.end();
  };
  const auto adds_up = [&](const Loop& loop) {
    return is_reduction(context, stage, loop.iterator);
  };
  // The steps of the tile, its reduction, and the other loops.
  add_ordered([&](const Loop& loop) { return is_side(loop) ? 0 : adds_up(loop) ? 1 : 2; });
  // Terms that tiles beside each other read stay in a cache while all of these run.
  const std::optional<size_t> lanes = vector_loop(*nest);
  if (!lanes || std::ranges::none_of(nest->loops, adds_up)) return;
  const int row = nest->loops[*lanes].iterator;
  add_ordered([&](const Loop& loop) {
    return adds_up(loop) ? 1 : is_side(loop) && loop.iterator != row ? 2 : 0;
  });
}

}  // namespace

std::vector<Plan> compute_in_tile(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  if (!has_loops(plan, func) || !may_run_in_loops(plan, context, func) ||
      !runs_at_any_size(plan.of(func), context, func))
    return plans;
  const std::optional<StageId> reader = direct_reader(plan, context, func);
  if (!reader) return plans;
  add_plans(plans, plan, func, *reader, context);
  // In a loop of another Func the consumer may have no room for a tile.
  if (plans.empty()) {
    for (const Plan& other : find_move("root")->apply(plan, reader->func, context))
      add_plans(plans, other, func, *reader, context);
  }
  return plans;
}

}  // namespace retrograde::planning::moves

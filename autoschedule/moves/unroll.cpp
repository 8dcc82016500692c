// unroll -- the innermost loop around a stage's body becomes part of it, by a step or wholly.
//
//   c, y, r.z, x:16, vector x     =>     c, y, r.z, x:32, unroll x:16, vector x     if copies share what they load
//   y, x:16, r.x, vector x        =>     y, x:16, unroll r.x, vector x              if r.x has few iterations
//   y, unroll r.x, vector x       =>     y, r.x, vector x
//   c, y, x:16, vector x          =>     y, c:3, x:16, unroll c, vector x           a dimension of few values
//   c, y, x:16, vector x          =>     c:2, y, x:16, unroll c, vector x           channels of a warp
//
// Legal: L2, since the order of all iterations stays, or that of a pure loop changes (L1), and L4: the extent of an unrolled
// loop is a step outside of it, or a constant of the reduction; L5.
// Large bodies cost more than they save: points at borders run outside of them. So copies are few, and many iterations
// of the loop around remain.
#include <algorithm>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

constexpr int64_t most_copies = 4, least_iterations = 8;
constexpr int64_t loops_of_register_tile = 2;

// Whether the stage has values that are the same at all points of the iterator.
bool shares_values(const StageNode& stage, int iterator) {
  const IteratorSet own = set_of(iterator);
  return std::ranges::any_of(stage.reads,
                             [&](const Access& read) { return !(read.moved_by() & own); }) ||
         std::ranges::any_of(stage.operations, [&](const OperationCount& operation) {
           return !(operation.depends & own);
         });
}

// Whether all points of the iterator share data-dependent indices, which differ from lane to lane.
bool shares_places(const StageNode& stage, const Nest& nest, int iterator) {
  const std::optional<size_t> lanes = vector_loop(nest);
  return lanes && std::ranges::any_of(stage.reads, [&](const Access& read) {
           IteratorSet data = 0;
           for (const IndexForm& index : read.index) data |= index.data_loops();
           return (data & set_of(nest.loops[*lanes].iterator)) && !(data & set_of(iterator)) &&
                  (read.moved_by() & set_of(iterator));
         });
}

// The nests in which the loop before the body is part of it.
std::vector<Nest> with_larger_body(const StageLoops& loops) {
  const auto& [plan, context, stage, nest, extents] = loops;
  const size_t body = body_depth(nest), d = body - 1;
  if (body == 0 || nest.loops[d].kind != ForType::Serial) return {};
  const auto [iterator, step] = std::pair(nest.loops[d].iterator, nest.loops[d].step);
  int64_t unrolled = 0;
  for (size_t b = body; b < nest.loops.size(); ++b) {
    if (nest.loops[b].kind != ForType::Unrolled) continue;
    if (nest.loops[b].iterator == iterator) return {};
    ++unrolled;
  }
  const bool is_whole = outer_step(nest, iterator, step) == 0;
  const int64_t count = trips(extents, nest, d);
  Nest larger = nest;
  larger.loops[d].kind = ForType::Unrolled;
  if (is_reduction(context, stage, iterator)) {
    const bool is_small = is_whole && step == 1 && count <= most_copies &&
                          context.sizes.of(stage, iterator).is_constant();
    return is_small && unrolled < loops_of_register_tile ? std::vector{larger}
                                                         : std::vector<Nest>{};
  }
  if (!shares_values(context.accesses.stage(stage), iterator)) return {};
  if (!is_whole && count <= most_copies)
    return trips(extents, nest, d - 1) >= least_iterations ? std::vector{larger}
                                                           : std::vector<Nest>{};
  std::vector<Nest> steps;
  for (int64_t n = 2; n <= most_copies && least_iterations * n <= count; n *= 2)
    insert_step(steps.emplace_back(larger), iterator, n * step, d);
  return steps;
}

// The nests in which points of a dimension that is no innermost one are part of the body, around its lanes: all that it
// has, or a few of more if they share the places of gathers.
std::vector<Nest> with_points_of_dimensions(const StageLoops& loops) {
  const auto& [plan, context, stage, nest, extents] = loops;
  std::vector<Nest> nests;
  const auto add = [&](size_t d, int64_t points, bool is_whole) {
    const Loop loop = nest.loops[d];
    Nest inside = nest;
    inside.loops.erase(inside.loops.begin() + static_cast<std::ptrdiff_t>(d));
    const size_t body = body_depth(inside);
    insert_step(inside, loop.iterator, 1, body, ForType::Unrolled);
    insert_step(inside, loop.iterator, points, is_whole ? body - 1 : d,
                is_whole ? ForType::Serial : loop.kind);
    if (is_whole && loop.kind == ForType::Parallel) run_in_parallel(inside, context, stage);
    nests.push_back(std::move(inside));
  };
  const size_t body = body_depth(nest);
  for (size_t d = shared_loops(plan, stage); d < body; ++d) {
    const Loop& loop = nest.loops[d];
    const int64_t count = extents[static_cast<size_t>(loop.iterator)];
    const bool is_alone = loop.step == 1 && outer_step(nest, loop.iterator, 1) == 0;
    if (!is_alone || count < 2 || body == 1 || is_reduction(context, stage, loop.iterator) ||
        !shares_values(context.accesses.stage(stage), loop.iterator))
      continue;
    if (count <= most_copies) add(d, count, true);
    const bool shares =
        d + 1 < body && shares_places(context.accesses.stage(stage), nest, loop.iterator);
    for (int64_t n = 2; shares && n <= most_copies && 2 * n <= count; n *= 2) add(d, n, false);
  }
  return nests;
}

std::vector<Nest> unrolled(const StageLoops& loops) {
  const auto& [plan, context, stage, nest, extents] = loops;
  std::vector<Nest> nests = with_larger_body(loops);
  std::ranges::move(with_points_of_dimensions(loops), std::back_inserter(nests));
  std::erase_if(nests, [&](const Nest& larger) {
    return body_operations(plan, context, stage, larger, extents) > most_body_operations;
  });
  const size_t body = body_depth(nest);
  if (body == nest.loops.size() || nest.loops[body].kind != ForType::Unrolled) return nests;
  Nest& rolled = nests.emplace_back(nest);
  rolled.loops[body].kind = ForType::Serial;
  const bool is_adjacent = body > 0 && nest.loops[body - 1].iterator == nest.loops[body].iterator;
  if (is_adjacent) drop_loop(rolled, body);
  return nests;
}

}  // namespace

std::vector<Plan> unroll(const Plan& plan, FuncId func, const Context& context) {
  return with_nests(plan, func, context, unrolled);
}

}  // namespace retrograde::planning::moves

// vectorise -- lanes along another iterator, or none.
//
//   y, x:16, vector x     =>     y:16, x, vector y      and      y, x
//   y, r.x                =>     y:8, r.x, unroll y     and      y:4, r.x, vector y     if f(r.x, y) needs f(r.x - 1, y)
//   x, r.y                =>     x:128, r.y, x:16, vector x                               if f(x, r.y) needs f(x, r.y - 1)
//
// The chains of a recurrence run side by side, as few as hide their latency: blocks of columns, or rows that lie apart.
//
// Legal: L1: iterations of pure loops never meet, and those of a reduction are lanes only if they don't; L4: a step of as
// many points as there are lanes stands outside. Lanes of a sum stay: removing them would make its chains of additions longer.
#include <algorithm>
#include <utility>

#include "autoschedule/access/lane_form.h"
#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

constexpr size_t most_iterators = 3;

// Whether elements of the stage wait for others.
bool is_recurrence(const StageNode& node) {
  return std::ranges::any_of(node.reads, [&](const Access& read) {
    return read.of == node.id.func && read.index != node.write.index;
  });
}

// The chains of a recurrence that hide its latency.
constexpr auto chains = static_cast<int64_t>(core.float_latency * core.products_per_cycle);

// The nest in which a block of vectors takes each step of the reduction, not one vector all steps.
std::optional<Nest> in_block(const StageLoops& loops, Nest nest, int iterator, int64_t lanes) {
  const size_t depth = *find_loop(nest, iterator, lanes), body = body_depth(nest);
  const int64_t points = points_inside(loops.extents, nest, static_cast<int>(depth) - 1, iterator);
  bool has_steps = false;
  for (size_t d = depth + 1; d < body; ++d)
    has_steps |= is_reduction(loops.context, loops.stage, nest.loops[d].iterator);
  if (!has_steps || 2 * chains * lanes > points) return std::nullopt;
  const ForType kind = std::exchange(nest.loops[depth].kind, ForType::Serial);
  const auto first = nest.loops.begin();
  std::rotate(first + static_cast<std::ptrdiff_t>(depth),
              first + static_cast<std::ptrdiff_t>(depth + 1),
              first + static_cast<std::ptrdiff_t>(body));
  insert_step(nest, iterator, chains * lanes, depth, kind);
  return nest;
}

std::vector<Nest> with_lanes(const StageLoops& loops) {
  const auto& [plan, context, stage, nest, extents] = loops;
  const std::optional<Nest> plain = without_body(nest, context, stage);
  if (!plain) return {};
  std::vector<int> iterators;
  for (int i = 0; i < static_cast<int>(extents.size()); ++i) {
    if (find_loop(*plain, i, 1)) iterators.push_back(i);
  }
  std::ranges::stable_sort(iterators, std::greater(),
                           [&](int i) { return lanes_together(loops.context, loops.stage, i); });
  std::vector<Nest> nests;
  const auto add = [&](int i, int64_t points, ForType kind) {
    Nest along = *plain;
    run_inside(along, i, points, kind);
    const bool may = may_run_at_once(loops.context, loops.stage, along, along.loops.size() - 1);
    if (may) nests.push_back(std::move(along));
    return may;
  };
  const StageNode& node = context.accesses.stage(stage);
  size_t tried = 0;
  for (const int i : iterators) {
    const auto depth = static_cast<int>(innermost_loop(*plain, i));
    const int64_t points = points_inside(extents, *plain, depth - 1, i);
    const int64_t lanes = lanes_for(plan, stage, points);
    if (lanes == 1 || tried == most_iterators) continue;
    if (!add(i, lanes, ForType::Vectorized)) continue;
    ++tried;
    if (!is_recurrence(node)) continue;
    const LaneForm form = lane_form(node.write, i, schedule_lanes, context.sizes, {line_elements});
    if (form.kind == LaneForm::Kind::Strided) {
      // Half as many where more would leave threads without rows.
      for (const int64_t count : {chains, chains / 2})
        if (fits(count, points)) add(i, count, ForType::Unrolled);
      for (const int64_t fewer : {lanes / 2, lanes / 4})
        if (fits(fewer, points)) add(i, fewer, ForType::Vectorized);
    } else if (std::optional<Nest> block = in_block(loops, nests.back(), i, lanes)) {
      nests.push_back(std::move(*block));
    }
  }
  nests.push_back(*plain);
  return nests;
}

}  // namespace

std::vector<Plan> vectorise(const Plan& plan, FuncId func, const Context& context) {
  return with_nests(plan, func, context, with_lanes);
}

}  // namespace retrograde::planning::moves

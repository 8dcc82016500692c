// vectorise -- lanes along another iterator, or none.
//
//   y, x:16, vector x     =>     y:16, x, vector y      and      y, x
//   y, r.x                =>     y:8, r.x, unroll y     and      y:4, r.x, vector y     if f(r.x, y) needs f(r.x - 1, y)
//
// The chains of a recurrence whose rows lie apart in memory run side by side, as few as hide their latency.
//
// Legal: L1: iterations of pure loops never meet, and those of a reduction are lanes only if they don't; L4: a step of as
// many points as there are lanes stands outside. Lanes of a sum stay: removing them would make its chains of additions longer.
#include <algorithm>

#include "autoschedule/access/lane_form.h"
#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

constexpr size_t most_iterators = 3;

// How many accesses have lanes that lie together, or share one element.
int together(const Context& context, StageId stage, int iterator) {
  const StageNode& node = context.accesses.stage(stage);
  int count = 0;
  const auto note = [&](const Access& access, int weight) {
    const LaneForm form =
        lane_form(access, iterator, schedule_lanes, context.sizes, {line_elements});
    if (form.kind == LaneForm::Kind::Contiguous) count += weight;
    if (form.kind == LaneForm::Kind::Strided || form.kind == LaneForm::Kind::Gather)
      count -= weight;
  };
  note(node.write, 2);
  for (const Access& read : node.reads) note(read, 1);
  return count;
}

// Whether elements of the stage wait for others along the iterators that they don't have in common, and rows of them lie
// apart.
bool has_chains_apart(const Context& context, StageId stage, int iterator) {
  const StageNode& node = context.accesses.stage(stage);
  const bool waits = std::ranges::any_of(node.reads, [&](const Access& read) {
    return read.of == stage.func && read.index != node.write.index;
  });
  return waits &&
         lane_form(node.write, iterator, schedule_lanes, context.sizes, {line_elements}).kind ==
             LaneForm::Kind::Strided;
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
                           [&](int i) { return together(loops.context, loops.stage, i); });
  std::vector<Nest> nests;
  const auto add = [&](int i, int64_t points, ForType kind) {
    Nest along = *plain;
    run_inside(along, i, points, kind);
    const bool may = may_run_at_once(loops.context, loops.stage, along, along.loops.size() - 1);
    if (may) nests.push_back(std::move(along));
    return may;
  };
  size_t tried = 0;
  for (const int i : iterators) {
    const auto depth = static_cast<int>(innermost_loop(*plain, i));
    const int64_t points = points_inside(extents, *plain, depth - 1, i);
    const int64_t lanes = lanes_for(plan, stage, points);
    if (lanes == 1 || tried == most_iterators) continue;
    if (!add(i, lanes, ForType::Vectorized)) continue;
    ++tried;
    if (!has_chains_apart(context, stage, i)) continue;
    const auto rows = static_cast<int64_t>(core.float_latency * core.products_per_cycle);
    if (fits(rows, points)) add(i, rows, ForType::Unrolled);
    if (fits(lanes / 4, points)) add(i, lanes / 4, ForType::Vectorized);
  }
  nests.push_back(*plain);
  return nests;
}

}  // namespace

std::vector<Plan> vectorise(const Plan& plan, FuncId func, const Context& context) {
  return with_nests(plan, func, context, with_lanes);
}

}  // namespace retrograde::planning::moves

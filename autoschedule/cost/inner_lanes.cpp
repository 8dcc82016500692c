// The lanes that lowering gives to innermost loops by itself (compiler/lower/vectors/vectorize_inner_loops.cpp).
#include <algorithm>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/terms.h"

namespace retrograde::planning {

void cover_lanes(const LaneLoop& lanes, Cover& cover) {
  const auto add = [&](int iterator, double points) {
    int64_t& covered = cover[static_cast<size_t>(iterator)];
    covered = std::max(covered, static_cast<int64_t>(points));
  };
  add(lanes.iterator, lanes.inner);
  if (lanes.outer >= 0) add(lanes.outer, lanes.count / lanes.inner);
}

namespace {

// The depth of a serial loop over single points with nothing inside of it but unrolled ones; -1: there is none.
int innermost_serial(const StageRun& run, const Group& group) {
  IteratorSet moved = 0;
  for (size_t d = run.nest.trips.size(); d-- > 0;) {
    const LoopNode& node = group.nodes[static_cast<size_t>(run.node_of(d))];
    if (node.children.size() + node.stages.size() != 1) return -1;
    if (node.kind == ForType::Serial) return moved & run.nest.moves[d] ? -1 : static_cast<int>(d);
    moved |= run.nest.moves[d];
    if (node.kind != ForType::Unrolled) return -1;
  }
  return -1;
}

// Whether every access has a vector form, and each iteration writes elements of its own.
bool can_be_lanes(const StageRun& run, const Group& group, const LaneLoop& lanes) {
  return std::ranges::all_of(run.facts->touches, [&](const Touch& touch) {
    const Layout& layout = group.buffers.at(touch.buffer).layout;
    const bool writes_one = touch.writes && (touch.moved & lanes.moves) == 0;
    return !writes_one && ((touch.data | touch.carried) & lanes.moves) == 0 &&
           !lane_moves(touch, layout, lanes, 1).is_by_lane;
  });
}

// Whether the body, with its unrolled copies, has no more nodes than lowering accepts.
bool is_small(const StageRun& run, const Group& group) {
  double nodes = 0;
  for (const OperationRow& row : run.facts->operations) nodes += row.count * nodes_of_operation;
  for (const Touch& touch : run.facts->touches) nodes += touch.count * nodes_of_access;
  for (size_t d = 0; d < run.nest.trips.size(); ++d) {
    const LoopNode& node = group.nodes[static_cast<size_t>(run.node_of(d))];
    if (node.kind == ForType::Unrolled) nodes *= run.nest.trips[d];
  }
  return nodes <= largest_vector_body;
}

}  // namespace

void add_inner_lanes(const SizeModel& sizes, const Machine& machine, Group& group) {
  if (has_kernels(group)) return;
  for (StageRun& run : group.runs) {
    const int depth = run.nest.lanes.iterator < 0 ? innermost_serial(run, group) : -1;
    if (depth < 0) continue;
    const auto d = static_cast<size_t>(depth);
    const auto& iterators = sizes.graph().stage(run.id).iterators;
    LaneLoop lanes;
    lanes.moves = run.nest.moves[d];
    for (size_t i = 0; i < iterators.size(); ++i) {
      if (lanes.moves == set_of(static_cast<int>(i)) && iterators[i].kind == Iterator::Kind::Pure)
        lanes.iterator = static_cast<int>(i);
    }
    double widest = 1;
    for (const Touch& touch : run.facts->touches) widest = std::max(widest, touch.element_bytes);
    lanes.depth = depth;
    lanes.count = lanes.inner = machine.vector_bytes / widest;
    if (lanes.iterator < 0 || run.nest.trips[d] < lanes.count || !is_small(run, group) ||
        !can_be_lanes(run, group, lanes))
      continue;
    run.nest.lanes = lanes;
    run.nest.trips[d] *= remainder_overhead / lanes.count;
    group.nodes[static_cast<size_t>(run.node_of(d))].trips /= lanes.count;
    for (size_t k = run.place + d; k < run.path.size(); ++k) {
      group.nodes[static_cast<size_t>(run.path[k])].times *= remainder_overhead / lanes.count;
      cover_lanes(lanes, run.cover[k + 1]);
    }
  }
}

}  // namespace retrograde::planning

// Where the elements are that the stages of a group touch.
#include <algorithm>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/group.h"

namespace retrograde::planning {

namespace {

double known_extent(const Extent& extent) {
  return static_cast<double>(std::max<int64_t>(extent.estimate, 1));
}

void fold(std::vector<double>& extents, const Storage& storage) {
  for (const Fold& fold : storage.folds) {
    double& extent = extents[static_cast<size_t>(fold.dimension)];
    extent = std::min(extent, static_cast<double>(fold.extent));
  }
}

class BufferFinder {
 public:
  BufferFinder(const Plan& plan, const SizeModel& sizes, const Machine& machine, const Group& group)
      : plan_(plan), sizes_(sizes), machine_(machine), group_(group) {}

  StoredBuffer find(const Touch& touch) const {
    const auto func_count = static_cast<int>(plan_.funcs.size());
    StoredBuffer result;
    for (size_t d = 0; d < touch.sides.size(); ++d)
      result.layout.order.push_back(static_cast<int16_t>(d));
    if (touch.buffer < func_count) {
      add_func(result, touch);
    } else {
      for (size_t d = 0; d < touch.sides.size(); ++d)
        result.layout.extents.push_back(
            known_extent(sizes_.of_image(touch.buffer - func_count, d)));
    }
    return result;
  }

 private:
  const Plan& plan_;
  const SizeModel& sizes_;
  const Machine& machine_;
  const Group& group_;

  const LoopNode& node(int index) const { return group_.nodes[static_cast<size_t>(index)]; }

  void add_func(StoredBuffer& result, const Touch& touch) const {
    const FuncPlan& plan = plan_.of(touch.buffer);
    if (plan.storage.order.size() == touch.sides.size()) result.layout.order = plan.storage.order;
    const StageRun* own = ir::first_where(group_.runs, [&](const StageRun& run) {
      return run.id == StageId{touch.buffer, 0};
    });
    if (!own || own->storage_place <= 1) {
      result.layout.extents = stored_extents(touch.buffer, plan, sizes_);
      if (own && plan.placement.compute.kind == Level::Kind::At) allocate(result, touch, *own);
      return;
    }
    const Cover& box = own->cover[own->storage_place];
    result.layout.extents.assign(box.begin(), box.end());
    fold(result.layout.extents, plan.storage);
    for (size_t d = 0; d < own->kept.size(); ++d) {
      double& extent = result.layout.extents[d];
      if (own->kept[d] > 0) extent = std::min(extent, static_cast<double>(own->kept[d]));
    }
    result.inside = own->storage_place;
    allocate(result, touch, *own);
    if (!is_on_stack(result.layout, touch)) result.heap_blocks = touch.components;
    result.register_share = register_share(result, touch);
  }

  void allocate(StoredBuffer& stored, const Touch& touch, const StageRun& own) const {
    double copies = 1;
    for (size_t k = 1; k < own.storage_place; ++k)
      if (runs_at_once(node(own.path[k]).kind)) copies *= node(own.path[k]).trips;
    stored.allocated_bytes = stored.layout.elements() * touch.element_bytes * touch.components *
                             std::min(copies, static_cast<double>(machine_.threads));
  }

  // Lowering bounds the extents of a box that grows with tiles. A box that has all coordinates of a dimension has as many
  // as a caller asks for, unless there is a bound. Blocks that are too large for the stack take longer to fill than the
  // heap takes to find them.
  bool is_on_stack(const Layout& layout, const Touch& touch) const {
    for (size_t d = 0; d < layout.extents.size(); ++d) {
      const Extent all = sizes_.of(touch.buffer, d);
      if (all.high > all.estimate && layout.extents[d] >= known_extent(all)) return false;
    }
    return true;
  }

  // A small array becomes registers if its indices are constants, and its vectors are loaded as they were stored: no loop
  // inside of its allocation but unrolled ones and vectors moves them. Reads that are clamped need a box of any size.
  double register_share(const StoredBuffer& stored, const Touch& written) const {
    for (const StageRun& run : group_.runs) {
      for (const Touch& touch : run.facts->touches) {
        if (touch.buffer != written.buffer || touch.moved == 0) continue;
        if (run.place > stored.inside || std::ranges::any_of(touch.sides, &TouchedSide::is_clamped))
          return 0;
        const LaneMoves moved = lane_moves(touch, stored.layout, run.nest.lanes, 1);
        if (moved.is_by_lane || moved.is_shifted || moved.shuffles > 0) return 0;
        for (size_t k = stored.inside; k < run.path.size(); ++k) {
          const LoopNode& loop = node(run.path[k]);
          const bool is_serial = loop.kind != ForType::Unrolled && loop.kind != ForType::Vectorized;
          if (is_serial && loop.trips > 1 && (run.nest.moves[k - run.place] & touch.moved))
            return 0;
        }
      }
    }
    const double bytes = stored.layout.elements() * written.element_bytes * written.components;
    const double room = static_cast<double>(machine_.vector_bytes) * machine_.registers;
    return bytes <= largest_register_array * room ? std::min(1.0, operand_share * room / bytes) : 0;
  }
};

}  // namespace

std::vector<double> stored_extents(FuncId func, const FuncPlan& plan, const SizeModel& sizes) {
  std::vector<double> extents;
  for (size_t d = 0; d < sizes.graph().func(func).func->args.size(); ++d)
    extents.push_back(known_extent(sizes.of(func, d)));
  fold(extents, plan.storage);
  return extents;
}

// Stages are in the order of their Funcs: a write comes before the reads.
void add_buffers(const Plan& plan, const SizeModel& sizes, const Machine& machine, Group& group) {
  const BufferFinder finder(plan, sizes, machine, group);
  for (const StageRun& run : group.runs) {
    for (const Touch& touch : run.facts->touches)
      if (!group.buffers.contains(touch.buffer)) group.buffers[touch.buffer] = finder.find(touch);
  }
}

}  // namespace retrograde::planning

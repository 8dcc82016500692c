// The loops of a kernel: blocks of a grid, threads of a block, and what each thread runs one after another.
#include <algorithm>
#include <bit>

#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/nest.h"

namespace retrograde::planning::moves {

namespace {

// Calls may be larger than estimates.
constexpr int64_t times_the_estimate = 16;

// A loop over blocks, and over the threads of each if there are any.
struct Tile {
  int16_t iterator = 0;
  int64_t threads = 1;
};

class KernelLoops {
 public:
  KernelLoops(const Plan& plan, const Context& context, StageId stage,
              const std::vector<int16_t>& order)
      : context_(context),
        node_(context.accesses.stage(stage)),
        order_(order),
        definition_(loops_of_definition(*plan.program->funcs[static_cast<size_t>(stage.func)],
                                        stage.stage)) {}

  Nest nest(const KernelShape& shape) const {
    if (context_.dependences.may_be_atomic(node_.id, context_.atomics)) {
      Nest all = over(every_iterator(), shape);
      all.concurrency = Concurrency::Atomic;
      return all;
    }
    for (const std::vector<int16_t>& grid : {free_iterators(), pure_iterators()}) {
      if (grid.empty()) continue;
      Nest result = over(grid, shape);
      if (keeps_order(context_, node_.id, result)) return result;
    }
    Nest one = definition_;
    one.loops.insert(one.loops.begin(), Loop());
    one.loops[0].iterator = once;
    one.loops[0].kind = ForType::GpuBlock;
    return one;
  }

 private:
  const Context& context_;
  const StageNode& node_;
  const std::vector<int16_t>& order_;
  const Nest definition_;

  Extent extent(int iterator) const { return context_.sizes.of(node_.id, iterator); }
  bool is_one(int iterator) const {
    const Extent e = extent(iterator);
    return e.is_known() && e.is_constant() && e.estimate == 1;
  }
  // The first in memory of the dimensions that it moves.
  int place_in_memory(int iterator) const {
    int result = static_cast<int>(order_.size());
    for (size_t d = 0; d < node_.write.index.size(); ++d) {
      if (!(node_.write.index[d].moved_by() & set_of(iterator))) continue;
      const auto at = std::ranges::find(order_, static_cast<int16_t>(d)) - order_.begin();
      result = std::min(result, static_cast<int>(at));
    }
    return result;
  }
  // In the order of dimensions in memory.
  template <typename Condition>
  std::vector<int16_t> iterators(Condition condition) const {
    std::vector<int16_t> result;
    for (size_t i = 0; i < node_.iterators.size(); ++i) {
      const auto iterator = static_cast<int16_t>(i);
      if (!is_one(iterator) && condition(iterator)) result.push_back(iterator);
    }
    std::ranges::stable_sort(result, {}, [&](int i) { return place_in_memory(i); });
    return result;
  }
  std::vector<int16_t> every_iterator() const {
    return iterators([](int) { return true; });
  }
  std::vector<int16_t> free_iterators() const {
    return iterators([&](int i) {
      return is_reduction(context_, node_.id, i) ? is_free(context_, node_.id, i) : stays(i);
    });
  }
  std::vector<int16_t> pure_iterators() const {
    return iterators([&](int i) { return !is_reduction(context_, node_.id, i) && stays(i); });
  }
  // Whether the stage reads its Func only where the pure iterator is. Adjoints may also read elsewhere and discard the
  // value, but that read races with the thread that writes there.
  bool stays(int iterator) const {
    const auto d = static_cast<size_t>(node_.iterators[static_cast<size_t>(iterator)].dimension);
    return std::ranges::all_of(node_.reads, [&](const Access& read) {
      return read.of != node_.id.func || read.index[d] == node_.write.index[d];
    });
  }

  // ---- the grid ----

  std::vector<Tile> tiles(std::vector<int16_t> grid, const KernelShape& shape) const {
    const Device& device = *context_.device;
    const auto first = std::ranges::find(grid, shape.first);
    if (first != grid.end()) std::rotate(grid.begin(), first, first + 1);
    std::vector<Tile> result;
    int64_t left = device.block_threads();
    for (const int16_t i : grid) {
      const Extent points = extent(i);
      const int64_t all = points.is_known() ? std::max<int64_t>(points.estimate, 1) : left;
      const auto wanted = static_cast<int64_t>(std::bit_ceil(static_cast<uint64_t>(all)));
      const int64_t most = result.empty() && grid.size() > 1 ? shape.along_first : left;
      const bool has_threads = result.size() < device.grid_dimensions;
      result.push_back({i, has_threads ? std::min({wanted, most, left}) : 1});
      left /= result.back().threads;
    }
    return result;
  }
  bool fits_grid(const std::vector<Tile>& tiles) const {
    const Device& device = *context_.device;
    return tiles.size() <= device.grid_dimensions &&
           std::all_of(tiles.begin() + 1, tiles.end(), [&](const Tile& tile) {
             const Extent e = extent(tile.iterator);
             return e.is_known() &&
                    e.estimate / tile.threads <= device.grid_blocks / times_the_estimate;
           });
  }

  Nest over(const std::vector<int16_t>& grid, const KernelShape& shape) const {
    const std::vector<Tile> all = tiles(grid, shape);
    Nest nest;
    std::vector<Loop> threads;
    for (const Tile& tile : all) {
      Loop block;
      block.iterator = tile.iterator;
      block.step = tile.threads;
      block.kind = ForType::GpuBlock;
      if (tile.threads > 1) {
        block.tail = TailStrategy::GuardWithIf;
        Loop thread;
        thread.iterator = tile.iterator;
        thread.kind = ForType::GpuThread;
        threads.insert(threads.begin(), thread);
      }
      nest.loops.insert(nest.loops.begin(), block);
    }
    if (!fits_grid(all)) fuse_blocks(nest);
    ir::append(nest.loops, threads);
    for (const Loop& loop : definition_.loops) {
      const auto is_it = [&](const Tile& tile) { return tile.iterator == loop.iterator; };
      if (std::ranges::none_of(all, is_it)) nest.loops.push_back(loop);
    }
    return nest;
  }
  void fuse_blocks(Nest& nest) const {
    while (nest.loops.size() > 1) {
      const Loop inner = nest.loops.back();
      nest.loops.pop_back();
      nest.fusions.push_back({inner, nest.loops.back()});
      Loop both;
      both.iterator = static_cast<int16_t>(node_.iterators.size() + nest.fusions.size() - 1);
      both.kind = ForType::GpuBlock;
      nest.loops.back() = both;
    }
  }
};

}  // namespace

Nest kernel_loops(const Plan& plan, const Context& context, StageId stage,
                  const std::vector<int16_t>& order, const KernelShape& shape) {
  return KernelLoops(plan, context, stage, order).nest(shape);
}

bool is_kernel(const Nest& nest) { return !nest.loops.empty() && is_gpu(nest.loops[0].kind); }

bool may_be_kernel(const Plan& plan, const Context& context, StageId stage) {
  const graph::FuncContents& f = *plan.program->funcs[static_cast<size_t>(stage.func)];
  const StageNode& node = context.accesses.stage(stage);
  if (plan.of(stage.func).opacity != Opacity::None || node.needs_host || f.is_extern() ||
      f.trace.stores || f.trace.loads || f.trace.realizations)
    return false;
  return std::ranges::all_of(node.reads, [&](const Access& read) {
    if (read.of < 0 || read.of == stage.func || !is_inlined(plan, read.of)) return true;
    return may_be_kernel(plan, context, {read.of, 0});
  });
}

}  // namespace retrograde::planning::moves

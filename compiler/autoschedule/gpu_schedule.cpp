#include "autoschedule/gpu_schedule.h"

#include <algorithm>
#include <bit>
#include <iterator>

#include "autoschedule/device_sums.h"
#include "autoschedule/kernel_limits.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/stage_loops.h"
#include "autoschedule/task_sizes.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/directives/give_directive.h"

namespace retrograde::autoschedule {

namespace {

// What is run may be larger than what was estimated.
constexpr int64_t times_the_estimate = 16;

// A loop over blocks, and that over the threads of each, if there is one.
struct Tile {
  StageLoop loop;
  int64_t threads = 1;

  std::optional<int64_t> blocks() const {
    if (!loop.extent) return std::nullopt;
    return (*loop.extent + threads - 1) / threads;
  }
};

class KernelChooser {
 public:
  KernelChooser(const FuncPtr& f, int stage, const std::vector<FuncPtr>& stored,
                const ScheduleRequest& request, const SizeEstimate& sizes)
      : f_(f),
        index_(stage),
        stage_(f, stage),
        stored_(stored),
        request_(request),
        loops_(loops_of_stage(*f, stage, sizes)) {}

  void give() {
    if (iterations_may_meet(*f_, index_, loops_) && may_be_atomic(*f_, index_, request_)) {
      stage_.atomic();
      for (StageLoop& loop : loops_) loop.is_independent = true;
    }
    std::vector<StageLoop> grid, serial;
    std::ranges::partition_copy(
        loops_, std::back_inserter(grid), std::back_inserter(serial),
        [](const StageLoop& loop) { return loop.is_independent && loop.extent != 1; });
    if (grid.empty()) {
      if (!serial.empty()) compute_block(serial[0].loop);
      stage_.gpu_single_thread();
      return;
    }
    std::ranges::stable_sort(grid, {}, &StageLoop::dimension);
    const bool is_long =
        std::ranges::any_of(serial, [](const StageLoop& loop) { return loop.extent != 1; });
    run(tiles_of(grid, is_long), serial);
  }

 private:
  // A block of partial sums is the thread's own, made for each iteration of the loop around.
  void compute_block(const VarOrRVar& around) {
    if (const FuncPtr block = block_read_by(f_->stage(index_), stored_))
      Func(block).compute_at(retrograde::LoopLevel(Func(f_), around, index_));
  }

  // Threads for what lies together in memory; short loops leave more of them to the next one.
  std::vector<Tile> tiles_of(const std::vector<StageLoop>& grid, bool is_long) const {
    const planning::Device& device = request_.device;
    std::vector<Tile> tiles;
    const int64_t along_one =
        grid.size() > 1 || is_long ? device.warp_size : device.block_threads();
    int64_t left = device.block_threads();
    for (const StageLoop& loop : grid) {
      const auto wanted = static_cast<int64_t>(
          std::bit_ceil(static_cast<uint64_t>(std::max<int64_t>(loop.extent.value_or(left), 1))));
      const bool has_threads = tiles.size() < device.grid_dimensions;
      tiles.push_back({loop, has_threads ? std::min({wanted, along_one, left}) : 1});
      left /= tiles.back().threads;
    }
    return tiles;
  }

  void run(const std::vector<Tile>& tiles, const std::vector<StageLoop>& serial) {
    std::vector<VarOrRVar> order, threads, blocks;
    for (const StageLoop& loop : serial) order.push_back(loop.loop);
    for (const Tile& tile : tiles) {
      const VarOrRVar& all = tile.loop.loop;
      blocks.push_back(all);
      if (tile.threads == 1) continue;
      const VarOrRVar own(inner_loop(*f_, index_, all.name()), all.is_rvar);
      stage_.split(all, all, own, static_cast<int>(tile.threads), TailStrategy::GuardWithIf);
      threads.push_back(own);
    }
    order.insert(order.end(), threads.begin(), threads.end());
    order.insert(order.end(), blocks.begin(), blocks.end());
    if (order.size() > 1) stage_.reorder(order);
    compute_block(order[0]);
    if (!fits_grid(tiles)) blocks = {fuse(blocks)};
    for (const VarOrRVar& block : blocks) stage_.gpu_blocks(block);
    for (const VarOrRVar& thread : threads) stage_.gpu_threads(thread);
  }

  bool fits_grid(const std::vector<Tile>& tiles) const {
    const planning::Device& device = request_.device;
    return tiles.size() <= device.grid_dimensions &&
           std::all_of(tiles.begin() + 1, tiles.end(), [&](const Tile& tile) {
             return tile.blocks() && *tile.blocks() <= device.grid_blocks / times_the_estimate;
           });
  }

  VarOrRVar fuse(const std::vector<VarOrRVar>& blocks) {
    VarOrRVar all = blocks[0];
    for (size_t i = 1; i < blocks.size(); ++i) {
      const VarOrRVar both(new_loop(*f_, index_, "block"), all.is_rvar || blocks[i].is_rvar);
      stage_.fuse(all, blocks[i], both);
      all = both;
    }
    return all;
  }

  const FuncPtr f_;
  const int index_;
  Stage stage_;
  const std::vector<FuncPtr>& stored_;
  const ScheduleRequest& request_;
  std::vector<StageLoop> loops_;
};

}  // namespace

GpuSchedule schedule_on_gpu(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
                            const std::unordered_set<const Symbol*>& but,
                            const ScheduleRequest& request) {
  std::vector<FuncPtr> free;
  std::ranges::copy_if(stored, std::back_inserter(free),
                       [](const FuncPtr& f) { return !has_directives(*f); });
  for (const FuncPtr& f : free) Func(f).compute_root();
  std::erase_if(free, [&](const FuncPtr& f) { return f->is_extern() || but.contains(f.get()); });
  const std::vector<FuncPtr> made =
      cut_sums_for_device(free, stored, request, SizeEstimate(outputs, machine_of(request)));
  free.insert(free.end(), made.begin(), made.end());
  GpuSchedule result{{}, SizeEstimate(outputs, machine_of(request))};
  for (const FuncPtr& f : free) {
    for (int s = 0; s < f->stage_count(); ++s) {
      if (can_be_kernel(f, s, stored))
        KernelChooser(f, s, stored, request, result.sizes).give();
      else
        result.on_host.push_back({f, s});
    }
  }
  return result;
}

}  // namespace retrograde::autoschedule

// The time of kernels: how many threads a device has to hide what each of them waits for, and what a warp loads at once.
#include <algorithm>
#include <cmath>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/terms.h"

namespace retrograde::planning {

namespace {

class Kernel {
 public:
  Kernel(const StageRun& run, const Group& group, const Device& device, const Machine& machine)
      : run_(run), group_(group), device_(device), machine_(machine) {
    for (size_t k = 1; k < run.path.size(); ++k) {
      const LoopNode& loop = node(k);
      if (loop.kind == ForType::GpuBlock) blocks_ *= loop.trips;
      if (is_gpu_thread(loop.kind)) threads_ *= loop.trips;
      if (is_gpu(loop.kind)) first_serial_ = k + 1;
      if (loop.kind == ForType::GpuBlock) first_thread_ = k + 1;
    }
  }

  StageCost cost() const {
    StageCost result;
    result.stage = run_.id;
    const double l1 = warp_bytes(), l2 = l2_bytes(l1), memory = whole_bytes();
    const double moving = std::max({memory / device_.bytes_per_ns, l2 / device_.l2_bytes_per_ns,
                                    l1 / device_.l1_bytes_per_ns});
    const double memory_ns = memory / device_.bytes_per_ns;
    result.bytes[Machine::near_cache] = l2;
    result.bytes[Machine::level_count - 1] = memory;
    result.memory_seconds[Machine::level_count - 1] = memory_ns / busy() * nanosecond;
    result.memory_seconds[Machine::near_cache] = (moving - memory_ns) / busy() * nanosecond;
    result.compute_seconds = std::max(work_ns() / busy(), chain_ns()) * nanosecond;
    if (run_.place <= 1) result.launch_seconds = device_.launch_ns * nanosecond;
    return result;
  }

 private:
  const StageRun& run_;
  const Group& group_;
  const Device& device_;
  const Machine& machine_;
  double blocks_ = 1, threads_ = 1;             // threads: of a block
  size_t first_thread_ = 0, first_serial_ = 0;  // nodes of the path

  const LoopNode& node(size_t k) const { return group_.nodes[static_cast<size_t>(run_.path[k])]; }
  double times(size_t k) const { return k == 0 ? 1 : node(k - 1).times; }
  double warps() const { return std::ceil(threads_ / device_.warp_size); }

  // The part of the device that has work. Threads hide waiting, so it takes all of them to be busy.
  double busy() const {
    const double resident = blocks_ * warps() * device_.warp_size;
    return std::min(1.0, resident / double(device_.enough_threads()));
  }

  // An operation that no serial loop changes is executed once by each thread.
  double work_ns() const {
    const double idle_lanes = warps() * device_.warp_size / threads_;
    double sum = 0;
    for (const OperationRow& row : run_.facts->operations) {
      size_t k = run_.path.size();
      while (k > first_serial_ &&
             (k <= run_.place || !(run_.nest.moves[k - 1 - run_.place] & row.depends)))
        --k;
      sum += row.count * row.time.vector_ns / machine_.operation_ns * times(k);
    }
    return sum * idle_lanes / device_.operations_per_ns;
  }
  // All iterations of one thread, one after another.
  double chain_ns() const {
    return times(run_.path.size()) / times(first_serial_) * device_.iteration_ns;
  }

  // ---- bytes ----

  double lines(const Touch& touch, const Cover& cover) const {
    return touched_lines(touch, group_.buffers.at(touch.buffer).layout, cover);
  }
  bool is_own_memory(const Touch& touch) const {  // registers of a thread
    return group_.buffers.at(touch.buffer).inside > first_thread_;
  }
  // The lines that all threads of a warp touch in one iteration.
  Cover cover_of_warp() const {
    Cover cover = run_.cover.back();
    double left = device_.warp_size;
    for (size_t k = first_serial_; k-- > run_.place && left > 1;) {
      if (!is_gpu_thread(node(k).kind)) continue;
      const double own = std::min(left, std::max(1.0, node(k).trips));
      left /= own;
      for (size_t i = 0; i < cover.size(); ++i) {
        if (run_.nest.moves[k - run_.place] & set_of(static_cast<int>(i)))
          cover[i] *= static_cast<int64_t>(own);
      }
    }
    return cover;
  }
  // The lines that all warps load and store. A warp needs no more lines than it has threads.
  double warp_bytes() const {
    const Cover warp = cover_of_warp();
    double all = 0;
    for (const Touch& touch : run_.facts->touches) {
      if (!is_own_memory(touch))
        all += touch.count * std::min<double>(lines(one_of(touch), warp), device_.warp_size);
    }
    return all * line_bytes * times(run_.path.size()) /
           std::min(double(device_.warp_size), threads_);
  }
  // One access of a window.
  static Touch one_of(Touch touch) {
    for (TouchedSide& side : touch.sides) side.taps = side.reach = 1;
    return touch;
  }
  // A block keeps what it touches again if the first cache holds all of it.
  double l2_bytes(double all_warps) const {
    double block_lines = 0;
    for (const Touch& touch : run_.facts->touches) {
      if (!is_own_memory(touch))
        block_lines += lines(touch, run_.cover[std::min(first_thread_, run_.cover.size() - 1)]);
    }
    const bool is_kept = block_lines * line_bytes <= static_cast<double>(device_.l1_bytes);
    const double all_blocks = times(first_thread_) * block_lines * line_bytes;
    return is_kept ? std::min(all_blocks, all_warps) : all_warps;
  }
  double whole_bytes() const {
    double sum = 0;
    for (const Touch& touch : run_.facts->touches) {
      if (!is_own_memory(touch)) sum += lines(touch, run_.cover[0]) * (touch.is_own ? 2 : 1);
    }
    return sum * line_bytes;
  }
};

}  // namespace

bool has_kernels(const Group& group) {
  return std::ranges::any_of(group.nodes, [](const LoopNode& node) { return is_gpu(node.kind); });
}

StageCost kernel_cost(const StageRun& run, const Group& group, const Device& device,
                      const Machine& machine) {
  return Kernel(run, group, device, machine).cost();
}

}  // namespace retrograde::planning

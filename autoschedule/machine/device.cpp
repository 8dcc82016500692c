#include "autoschedule/machine/device.h"

#include <sstream>

namespace retrograde::planning {

int64_t Device::block_threads() const { return int64_t{4} * warp_size; }

int64_t Device::enough_threads() const { return int64_t{multiprocessors} * threads; }

int64_t Device::few_threads() const { return enough_threads() / 8; }

std::string Device::to_string() const {
  std::ostringstream out;
  out << multiprocessors << " multiprocessors of " << threads << " threads in warps of "
      << warp_size << " and " << registers << " registers, " << shared_bytes / 1024
      << " KB of shared memory for a block, " << l2_bytes / 1024 << " KB of L2, " << bytes_per_ns
      << " GB/s";
  return out.str();
}

}  // namespace retrograde::planning

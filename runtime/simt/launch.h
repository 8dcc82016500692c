// One launch of a kernel on the simulated device.
#pragma once

#include <cstdint>
#include <vector>

#include "simt/state.h"

namespace retrograde::simt {

struct Launch {
  const retrograde_gpu_kernel* kernel;
  int32_t blocks[3], threads[3];
  int32_t shared_bytes;
  std::vector<uint64_t> args;  // the argument memory, in words so that it is aligned
  int device;

  int32_t threads_of_block() const { return threads[0] * threads[1] * threads[2]; }
  int64_t number_of_blocks() const { return int64_t{blocks[0]} * blocks[1] * blocks[2]; }
};

// Runs all blocks, one after another. On an error, the finding has its text.
Result run(const Launch&);

}  // namespace retrograde::simt

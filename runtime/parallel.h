// Runs a parallel loop for any caller.
#pragma once

#include <cstdint>

namespace retrograde::runtime {

struct ParallelLoop {
  int32_t min, extent;
  int32_t thread_limit;  // 0: no limit
  void* data;
  int32_t (*run)(void* data, int32_t index);  // one iteration; returns an error code
  // Called after the loop with the error of the lowest failing iteration.
  void (*report)(void* data, int32_t code, const char* message);
};

// Returns the code of the lowest failing iteration, or 0. Iterations above a failing one may be skipped.
int32_t run_parallel_loop(const ParallelLoop& loop);

}  // namespace retrograde::runtime

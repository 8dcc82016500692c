// A parallel loop, whoever asks for it.
#pragma once

#include <cstdint>

namespace retrograde::runtime {

struct ParallelLoop {
  int32_t min, extent;
  int32_t thread_limit;  // 0: all
  void* data;
  int32_t (*run)(void* data, int32_t index);  // one iteration; gives an error code
  // Told of the error of the lowest failing iteration, after the loop.
  void (*report)(void* data, int32_t code, const char* message);
};

// Gives the code of the lowest failing iteration, 0 when there is none. Iterations above a failing
// one may be skipped.
int32_t run_parallel_loop(const ParallelLoop& loop);

}  // namespace retrograde::runtime

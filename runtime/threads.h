// The threads under the parallel loops.
#pragma once

#include <cstdint>

namespace retrograde::runtime {

// Calls run(data, begin, end) for ranges that together are [0, extent), on up to `thread_limit`
// threads (0: all), and returns when all have returned. `run` must not throw.
void run_on_threads(int64_t extent, int32_t thread_limit,
                    void (*run)(void* data, int64_t begin, int64_t end), void* data);

}  // namespace retrograde::runtime

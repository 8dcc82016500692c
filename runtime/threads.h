// Runs ranges of iterations on threads, for parallel loops.
#pragma once

#include <cstdint>

namespace retrograde::runtime {

// Calls run(data, begin, end) for ranges that together cover [0, extent), on at most `thread_limit` threads (0: no
// limit). Returns when all calls have returned. `run` must not throw.
void run_on_threads(int64_t extent, int32_t thread_limit,
                    void (*run)(void* data, int64_t begin, int64_t end), void* data);

}  // namespace retrograde::runtime

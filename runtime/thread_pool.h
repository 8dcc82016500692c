// Settings of our own thread pool.
#pragma once

namespace retrograde::runtime {

constexpr int max_threads = 256;

// Sets the number of threads of later loops, including the caller of each. 0: the value of HL_NUM_THREADS, or the
// machine's number of processors. Returns the previous setting.
int set_thread_count(int count);
int thread_count();
// Joins the workers. A later loop starts them again. Must not be called from inside a loop.
void shut_down_threads();

}  // namespace retrograde::runtime

// What can be told to our own thread pool.
#pragma once

namespace retrograde::runtime {

constexpr int max_threads = 256;

// Threads of later loops, the caller of each included; 0: as many as HL_NUM_THREADS says or the
// machine has. Gives what was set before.
int set_thread_count(int count);
int thread_count();
// Joins the workers. A later loop starts them again. Must not be called from inside a loop.
void shut_down_threads();

}  // namespace retrograde::runtime

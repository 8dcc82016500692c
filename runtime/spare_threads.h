// Threads that are lent for one piece of work each, and kept for the next.
#pragma once

namespace retrograde::runtime {

struct SpareThread;

// Begins run(data) on a thread that does nothing else until `finish_on`. Never waits for one to
// come free: who nests forks, or runs many at once, gets a thread for each. Null: the system has no
// thread left.
SpareThread* begin_on_spare_thread(void (*run)(void*), void* data);

// Waits for the end of what `begin_on_spare_thread` began.
void finish_on(SpareThread* thread);

// Ends those that nobody has borrowed; also runs when the library is unloaded.
void end_spare_threads();

}  // namespace retrograde::runtime

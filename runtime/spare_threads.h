// Lends threads for one piece of work each, and keeps them for reuse.
#pragma once

namespace retrograde::runtime {

struct SpareThread;

// Starts run(data) on a thread that does nothing else until `finish_on`. It never waits for a thread to become free:
// nested or concurrent forks get a thread each. Null if the system cannot create a thread.
SpareThread* begin_on_spare_thread(void (*run)(void*), void* data);

// Waits for the work that `begin_on_spare_thread` started.
void finish_on(SpareThread* thread);

// Ends the threads that are not borrowed; also runs when the library is unloaded.
void end_spare_threads();

}  // namespace retrograde::runtime

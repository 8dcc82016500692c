// stop.cpp -- see stop.h.
#include "common/stop.h"

#include <atomic>
#include <csignal>

namespace apps {

namespace {

// A signal reaches a process, not an object: this is the one place for it.
std::atomic<bool> stop_flag{false};
static_assert(std::atomic<bool>::is_always_lock_free);

void on_stop_signal(int) { stop_flag = true; }

}  // namespace

void catch_stop_signals() {
  struct sigaction action {};
  action.sa_handler = on_stop_signal;
  // The next one finds the default again, and ends the program.
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM}) ::sigaction(signal, &action, nullptr);
}

bool stop_requested() { return stop_flag; }

void request_stop(bool stop) { stop_flag = stop; }

}  // namespace apps

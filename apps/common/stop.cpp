// stop.cpp -- see stop.h.
#include "common/stop.h"

#include <atomic>
#include <csignal>
#include <cstdint>
#include <ctime>

namespace apps {

namespace {

// timeout(1) sends its signal to a program and then to the program's group; this counts as one request.
constexpr int64_t same_wish_ns = 200'000'000;

// A signal is delivered to the process, so this state is global.
std::atomic<int64_t> stopped_at{0};  // by the monotonic clock, in ns; 0: not stopped
static_assert(std::atomic<int64_t>::is_always_lock_free);

int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

void on_stop_signal(int signal) {
  int64_t first = 0;
  const int64_t now = now_ns();
  if (stopped_at.compare_exchange_strong(first, now) || now - first < same_wish_ns) return;
  ::signal(signal, SIG_DFL);  // ends the program once the handler returns
  ::raise(signal);
}

}  // namespace

void catch_stop_signals() {
  struct sigaction action {};
  action.sa_handler = on_stop_signal;
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM}) ::sigaction(signal, &action, nullptr);
}

bool stop_requested() { return stopped_at != 0; }

void request_stop(bool stop) { stopped_at = stop ? now_ns() : 0; }

}  // namespace apps

// Runs a function in a separate process, so that a crash or a hang is a result like any other.
#pragma once

#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>

namespace retrograde::fuzz {

struct ApartResult {
  int code = 0;             // the function's return value
  int signal = 0;           // the signal that ended it instead; SIGXCPU and SIGKILL: a time limit
  bool has_exited = false;  // before the function returned, as sanitizers do
  std::string detail;

  bool is_slow() const { return signal == SIGXCPU || signal == SIGKILL; }
  bool is_crash() const { return signal != 0 || has_exited; }
  std::string crash() const {
    return has_exited ? "exits with code " + std::to_string(code)
                      : std::string("crashes: ") + strsignal(signal);
  }
};

struct ApartLimits {
  unsigned cpu_seconds = 60;
  unsigned seconds = 240;   // limit of elapsed time, which also holds on a busy machine
  size_t memory_bytes = 0;  // limit of address space; 0: none
};

// The byte that a process sends last if its function has returned.
constexpr char has_returned = '\n';

// Returns whether the other end was closed in time.
inline bool read_all(int from, std::chrono::steady_clock::time_point end, std::string& text) {
  char chunk[4096];
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    pollfd ready = {from, POLLIN, 0};
    if (left.count() <= 0 || poll(&ready, 1, static_cast<int>(left.count())) == 0) return false;
    const ssize_t n = read(from, chunk, sizeof(chunk));
    if (n <= 0) return true;
    text.append(chunk, static_cast<size_t>(n));
  }
}

// `f` returns an exit code below 256 and fills in the detail.
inline ApartResult run_apart(const ApartLimits& limits, const std::function<int(std::string&)>& f) {
  int ends[2];
  if (pipe(ends) != 0) std::exit(2);
  const pid_t child = fork();
  if (child < 0) std::exit(2);
  if (child == 0) {
    close(ends[0]);
    const rlimit cpu = {limits.cpu_seconds, limits.cpu_seconds + 1};
    setrlimit(RLIMIT_CPU, &cpu);
    if (limits.memory_bytes > 0) {
      const rlimit memory = {limits.memory_bytes, limits.memory_bytes};
      setrlimit(RLIMIT_AS, &memory);
    }
    alarm(limits.seconds + 10);  // in case the harness has ended
    std::string detail;
    const int code = f(detail);
    detail += has_returned;
    const ssize_t written = write(ends[1], detail.data(), detail.size());
    _exit(written < 0 ? 2 : code);
  }
  close(ends[1]);
  ApartResult result;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(limits.seconds);
  if (!read_all(ends[0], end, result.detail)) kill(child, SIGKILL);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFSIGNALED(status)) {
    result.signal = WTERMSIG(status);
  } else {
    result.code = WEXITSTATUS(status);
    result.has_exited = result.detail.empty() || result.detail.back() != has_returned;
  }
  if (!result.is_crash()) result.detail.pop_back();
  return result;
}

}  // namespace retrograde::fuzz

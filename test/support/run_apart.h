// Runs a function in a process of its own: a crash or a hang there is a result like any other.
#pragma once

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>

namespace retrograde::fuzz {

struct ApartResult {
  int code = 0;             // what the function returned
  int signal = 0;           // what ended it instead; SIGXCPU and SIGALRM: it took too long
  bool has_exited = false;  // before the function returned, as sanitizers do
  std::string detail;

  bool is_slow() const { return signal == SIGXCPU || signal == SIGALRM || signal == SIGKILL; }
  bool is_crash() const { return signal != 0 || has_exited; }
  std::string crash() const {
    return has_exited ? "exits with code " + std::to_string(code)
                      : std::string("crashes: ") + strsignal(signal);
  }
};

struct ApartLimits {
  unsigned cpu_seconds = 60;
  unsigned seconds = 240;   // it may stand still for so long, on a machine however busy
  size_t memory_bytes = 0;  // of address space; 0: no limit
};

// Ends what a process sends whose function returned.
constexpr char has_returned = '\n';

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
    alarm(limits.seconds);
    std::string detail;
    const int code = f(detail);
    detail += has_returned;
    const ssize_t written = write(ends[1], detail.data(), detail.size());
    _exit(written < 0 ? 2 : code);
  }
  close(ends[1]);
  ApartResult result;
  char chunk[4096];
  for (ssize_t n; (n = read(ends[0], chunk, sizeof(chunk))) > 0;)
    result.detail.append(chunk, static_cast<size_t>(n));
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

#include "child.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <utility>

extern "C" char** environ;

namespace device_check {
namespace {

using Clock = std::chrono::steady_clock;

std::vector<std::string> environment_with(const std::map<std::string, std::string>& changes) {
  std::vector<std::string> lines;
  for (char** line = environ; *line; ++line) {
    const std::string text = *line;
    if (!changes.count(text.substr(0, text.find('=')))) lines.push_back(text);
  }
  for (const auto& [name, value] : changes) lines.push_back(name + "=" + value);
  return lines;
}

std::vector<char*> pointers_to(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

struct Pipe {
  int ends[2] = {-1, -1};
  Pipe() {
    if (pipe2(ends, O_CLOEXEC) != 0) ends[0] = ends[1] = -1;
  }
  ~Pipe() {
    for (const int end : ends) {
      if (end >= 0) close(end);
    }
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_writing() { close(std::exchange(ends[1], -1)); }
};

// Reads what the child writes to both pipes, until both end; false if the deadline comes first.
bool read_both(Pipe (&pipes)[2], std::string* (&texts)[2], Clock::time_point deadline) {
  std::array<pollfd, 2> open = {pollfd{pipes[0].ends[0], POLLIN, 0},
                                pollfd{pipes[1].ends[0], POLLIN, 0}};
  std::array<char, 4096> part;
  while (open[0].fd >= 0 || open[1].fd >= 0) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) return false;
    if (poll(open.data(), open.size(), static_cast<int>(left.count())) < 0 && errno != EINTR)
      return false;
    for (size_t i = 0; i < 2; ++i) {
      if (open[i].fd < 0 || !(open[i].revents & (POLLIN | POLLHUP))) continue;
      const ssize_t got = read(open[i].fd, part.data(), part.size());
      if (got > 0) texts[i]->append(part.data(), static_cast<size_t>(got));
      if (got == 0) open[i].fd = -1;  // poll ignores negative descriptors
    }
  }
  return true;
}

}  // namespace

Ended run_child(const std::vector<std::string>& words,
                const std::map<std::string, std::string>& environment, double seconds) {
  const auto deadline =
      Clock::now() + std::chrono::milliseconds(static_cast<int64_t>(seconds * 1e3));
  Ended ended;
  Pipe pipes[2];
  std::vector<std::string> arguments = words, lines = environment_with(environment);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (int i = 0; i < 2; ++i) posix_spawn_file_actions_adddup2(&actions, pipes[i].ends[1], i + 1);
  pid_t child = 0;
  const int error = posix_spawnp(&child, words[0].c_str(), &actions, nullptr,
                                 pointers_to(arguments).data(), pointers_to(lines).data());
  posix_spawn_file_actions_destroy(&actions);
  for (Pipe& pipe : pipes) pipe.close_writing();
  if (error != 0) return ended;
  std::string* texts[2] = {&ended.out, &ended.err};
  ended.timed_out = !read_both(pipes, texts, deadline);
  if (ended.timed_out) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return ended;
  }
  ended.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return ended;
}

std::string find_program(const std::string& name, const std::vector<std::string>& folders) {
  std::vector<std::string> all;
  const char* path = std::getenv("PATH");
  std::istringstream list(path ? path : "");
  for (std::string folder; std::getline(list, folder, ':');) all.push_back(folder);
  all.insert(all.end(), folders.begin(), folders.end());
  for (const std::string& folder : all) {
    const std::string program = folder + "/" + name;
    if (access(program.c_str(), X_OK) == 0 && !std::filesystem::is_directory(program))
      return program;
  }
  return "";
}

}  // namespace device_check

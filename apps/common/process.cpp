// process.cpp -- see process.h.
#include "common/process.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "diagnostics/error.h"

namespace apps {

using retrograde::text;

namespace {

struct Pipe {
  int read = -1;
  int write = -1;
};

// Close-on-exec, so that a second child does not keep the first one's pipes open.
Pipe make_pipe(const std::string& purpose) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) {
    retrograde::call_error(text("start ", retrograde::quoted(purpose)),
                           "a program is reached through pipes", std::strerror(errno),
                           "Raise the limit of open files");
  }
  return {ends[0], ends[1]};
}

std::vector<char*> pointers(const std::vector<std::string>& words) {
  std::vector<char*> out;
  for (const std::string& word : words) out.push_back(const_cast<char*>(word.c_str()));
  out.push_back(nullptr);
  return out;
}

// Runs in the forked process, so it only makes async-signal-safe calls.
[[noreturn]] void become(const std::vector<char*>& arguments, char* const* environment) {
  ::signal(SIGPIPE, SIG_DFL);
  ::execvpe(arguments[0], arguments.data(), environment);
  ::_exit(127);
}

std::vector<std::string> with_environment(
    const std::vector<std::pair<std::string, std::string>>& more) {
  std::vector<std::string> out;
  for (char** entry = environ; *entry; ++entry) {
    const std::string variable = *entry;
    const bool replaced = std::any_of(more.begin(), more.end(), [&](const auto& pair) {
      return variable.starts_with(pair.first + "=");
    });
    if (!replaced) out.push_back(variable);
  }
  for (const auto& [name, value] : more) out.push_back(text(name, "=", value));
  return out;
}

int exit_status(pid_t id) {
  int status = 0;
  while (::waitpid(id, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

// Calls read() or write() until all bytes are transferred; returns false if that fails or the pipe's end is closed.
template <typename Call, typename Byte>
bool transfer(const Call& call, int descriptor, Byte* at, size_t bytes) {
  while (bytes > 0) {
    const ssize_t done = call(descriptor, at, bytes);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    at += done;
    bytes -= static_cast<size_t>(done);
  }
  return true;
}

}  // namespace

Child::Child(const std::filesystem::path& program, const std::vector<std::string>& arguments,
             const std::vector<std::pair<std::string, std::string>>& environment) {
  if (::access(program.c_str(), X_OK) != 0) {
    retrograde::call_error(text("start ", retrograde::quoted(program.string())),
                           "it must be a program", std::strerror(errno),
                           "Install it beside this one");
  }
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const std::vector<std::string> variables = with_environment(environment);
  const std::vector<char*> word_pointers = pointers(words), variable_pointers = pointers(variables);
  const Pipe in = make_pipe(program.string()), out = make_pipe(program.string());
  id_ = ::fork();
  if (id_ == 0) {
    ::dup2(in.read, STDIN_FILENO);
    ::dup2(out.write, STDOUT_FILENO);
    become(word_pointers, variable_pointers.data());
  }
  ::close(in.read);
  ::close(out.write);
  to_ = in.write;
  from_ = out.read;
  if (id_ < 0) {
    const int error = errno;
    ::close(to_);
    ::close(from_);
    retrograde::call_error(text("start ", retrograde::quoted(program.string())),
                           "it needs a process of its own", std::strerror(error),
                           "Raise the limit of processes");
  }
}

Child::~Child() {
  ::close(to_);
  ::close(from_);
  exit_status(id_);
}

bool Child::send(const void* data, size_t bytes) {
  return transfer(::write, to_, static_cast<const char*>(data), bytes);
}

bool Child::receive(void* data, size_t bytes) {
  return transfer(::read, from_, static_cast<char*>(data), bytes);
}

Outcome run_program(const std::vector<std::string>& command) {
  Outcome outcome;
  const std::vector<char*> words = pointers(command);
  const Pipe out = make_pipe(command.front());
  const pid_t id = ::fork();
  if (id == 0) {
    ::dup2(out.write, STDOUT_FILENO);
    ::dup2(out.write, STDERR_FILENO);
    become(words, environ);
  }
  ::close(out.write);
  std::array<char, 4096> block;
  for (ssize_t n; id > 0 && (n = ::read(out.read, block.data(), block.size())) != 0;) {
    if (n < 0 && errno != EINTR) break;
    if (n > 0) outcome.output.append(block.data(), static_cast<size_t>(n));
  }
  ::close(out.read);
  if (id > 0) outcome.status = exit_status(id);
  outcome.started = id > 0 && outcome.status != 127;
  return outcome;
}

std::filesystem::path program_folder() {
  std::error_code failed;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", failed);
  return failed ? std::filesystem::current_path() : self.parent_path();
}

double peak_memory_mb() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;  // the kernel counts in KiB
}

}  // namespace apps

// process.h -- runs other programs and communicates with them through pipes; measures this process.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace apps {

// A running program whose standard input and output are connected to us; it shares our standard error. The destructor
// ends it by closing its input.
class Child {
 public:
  // `environment` is added to ours. Throws retrograde::UserError if the program cannot start.
  Child(const std::filesystem::path& program, const std::vector<std::string>& arguments,
        const std::vector<std::pair<std::string, std::string>>& environment);
  ~Child();

  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // Transfer whole blocks; return false if the program has exited.
  bool send(const void* data, size_t bytes);
  bool receive(void* data, size_t bytes);

 private:
  pid_t id_ = -1;
  int to_ = -1;
  int from_ = -1;
};

// The result of running a program to its end. `output` is its standard output and standard error.
struct Outcome {
  bool started = false;
  int status = 0;  // exit status, or 128 + signal number
  std::string output;
};
Outcome run_program(const std::vector<std::string>& command);

// The folder that contains the running program, for files installed relative to it.
std::filesystem::path program_folder();

// The largest resident set size of this process so far.
double peak_memory_mb();

}  // namespace apps

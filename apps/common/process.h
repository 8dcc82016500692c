// process.h -- other programs, run beside this one and spoken to through pipes; what this one uses.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace apps {

// A program with its standard input and output in our hands; its standard error is ours. Ended with
// this object, politely: it reads an end of file.
class Child {
 public:
  // `environment` is added to ours. Throws retrograde::UserError when the program cannot start.
  Child(const std::filesystem::path& program, const std::vector<std::string>& arguments,
        const std::vector<std::pair<std::string, std::string>>& environment);
  ~Child();

  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // Whole blocks. False when the program has gone away.
  bool send(const void* data, size_t bytes);
  bool receive(void* data, size_t bytes);

 private:
  pid_t id_ = -1;
  int to_ = -1;
  int from_ = -1;
};

// Runs a program to its end. `output` is what it wrote to standard output and standard error.
struct Outcome {
  bool started = false;
  int status = 0;  // exit status, or 128 + signal
  std::string output;
};
Outcome run_program(const std::vector<std::string>& command);

// The folder of the running program, for files that are installed relative to it.
std::filesystem::path program_folder();

// The largest resident size that this process ever had.
double peak_memory_mb();

}  // namespace apps

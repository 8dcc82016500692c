// worker.h -- controls one worker: a kernel, compiled by one of the compilers, in a process of its own. So the two
// sides share neither memory nor threads nor crashes.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/process.h"

namespace bench {

enum class Side { Retrograde, Halide };

// The kernel does not compile or run, or the worker has ended; contains its message.
struct WorkerError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Job {
  std::string kernel;
  bool small = false;
  int threads = 1;
  bool is_gradient = false;
};

// The command that starts a worker.
struct WorkerCommand {
  std::filesystem::path program;
  std::vector<std::string> arguments;
};

// The elements of one output, converted from their type.
struct Values {
  bool integers = false;
  std::vector<double> elements;
};

class Worker {
 public:
  // Compiles the kernel. `programs` is the folder of the two worker programs.
  Worker(Side side, const Job& job, const std::filesystem::path& programs);
  // Any other program that implements worker_protocol.h.
  Worker(Side side, const WorkerCommand& command, int threads);

  double run();  // seconds
  // For later runs; at most the number that it was started with. Only for our worker.
  void set_threads(int threads);
  // Transferred through a file in `scratch`.
  std::vector<Values> outputs(const std::filesystem::path& scratch);
  // For a gradient: its error against differences of its own program (../gradients/slope.h), or of one in a library.
  double slope_error(const std::filesystem::path& library = {});
  struct Memory {
    double peak_mb, run_mb;
  };
  Memory memory();

  double compile_seconds = 0, start_seconds = 0, bytes = 0, operations = 0;

 private:
  // The numbers after `expected` in the worker's next line.
  std::vector<double> answer(const std::string& expected);
  std::vector<double> ask(const std::string& order, const std::string& expected);
  [[noreturn]] void fail(const std::string& what) const;

  Side side_;
  apps::Child process_;
};

}  // namespace bench

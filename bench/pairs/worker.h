// worker.h -- the benchmark's handle on one worker: one kernel, compiled by one of the compilers,
// in a process of its own, so that neither side's memory, threads or faults are the other's.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/process.h"

namespace bench {

enum class Side { Retrograde, Halide };

// The kernel does not compile or does not run, or the worker has ended: what it said.
struct WorkerError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Job {
  std::string kernel;
  bool small = false;
  int threads = 1;
  bool is_gradient = false;
};

// How a worker is started.
struct WorkerCommand {
  std::filesystem::path program;
  std::vector<std::string> arguments;
};

// The elements of one output, whatever their type was.
struct Values {
  bool integers = false;
  std::vector<double> elements;
};

class Worker {
 public:
  // Compiles. `programs` is the folder of the two worker programs.
  Worker(Side side, const Job& job, const std::filesystem::path& programs);
  // Another that speaks worker_protocol.h.
  Worker(Side side, const WorkerCommand& command, int threads);

  double run();  // seconds
  // Of the runs to come, as many as it was started for at most. Of ours only.
  void set_threads(int threads);
  // By way of a file in `scratch`.
  std::vector<Values> outputs(const std::filesystem::path& scratch);
  // Of a gradient: how far it is from differences of its own program (../gradients/slope.h), or of
  // one in a library.
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

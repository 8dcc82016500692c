// pair.h -- runs one kernel on both sides: compiles, compares, and times alternating runs.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "worker.h"

namespace bench {

// Times of one side, in milliseconds. The spread is that of the middle half of the runs.
struct Timing {
  double median = 0, least = 0, spread = 0;
};
Timing timing_of(std::vector<double> milliseconds);

struct PairResult {
  std::string kernel;
  int threads = 1;
  std::string failure;  // if empty, all other fields are valid
  Timing retrograde, halide;
  double retrograde_compile_ms = 0, halide_compile_ms = 0;
  Worker::Memory retrograde_memory{}, halide_memory{};
  double max_relative_error = 0;
  // For gradients that differ: the error of each against differences of its own program.
  std::optional<double> retrograde_slope_error, halide_slope_error;
  bool integers = false;  // all outputs are integers
  double bytes = 0, operations = 0;
};

// The largest |a - b| / max(|b|, scale) over all elements, where scale is the root mean square of b's output. So a
// small difference of large numbers is judged relative to these. Infinite if shapes differ, or if only one side has a
// NaN.
double max_relative_error(const std::vector<Values>& a, const std::vector<Values>& b);
// Whether our worker, started with the largest number of threads, gives the same bits with all of these numbers.
bool has_same_bits_on(const std::vector<int>& threads, Worker& worker,
                      const std::filesystem::path& scratch);
// The largest max_relative_error with which both sides count as equal.
double tolerance(const PairResult& result);
// A gradient with a larger slope error counts as wrong.
inline constexpr double wrong_slope = 0.02;

// The two workers of one kernel.
class Pair {
 public:
  Pair(const Job& job, const std::filesystem::path& programs);
  Pair(const Job& job, const WorkerCommand& retrograde, const WorkerCommand& halide);

  // Runs each side once; which one goes first alternates. Returns our milliseconds.
  double run();
  PairResult result(const std::filesystem::path& scratch);
  // For gradients that have run: measures the error of each against differences of the program in a library.
  void check_slopes(PairResult& result, const std::filesystem::path& primal);
  // Our worker, for requests to only one side.
  Worker& retrograde() { return retrograde_; }

 private:
  void warm_up();

  Job job_;
  Worker retrograde_, halide_;
  std::vector<double> retrograde_ms_, halide_ms_;
};

}  // namespace bench

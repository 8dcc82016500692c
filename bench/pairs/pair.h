// pair.h -- one kernel on both sides: compiled, compared, and timed run by run in turn.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "worker.h"

namespace bench {

// Of one side, in milliseconds. The spread is that of the middle half of the runs.
struct Timing {
  double median = 0, least = 0, spread = 0;
};
Timing timing_of(std::vector<double> milliseconds);

struct PairResult {
  std::string kernel;
  int threads = 1;
  std::string failure;  // empty: all that follows is there
  Timing retrograde, halide;
  double retrograde_compile_ms = 0, halide_compile_ms = 0;
  Worker::Memory retrograde_memory{}, halide_memory{};
  double max_relative_error = 0;
  // Of gradients that differ: how far each is from differences of its own program.
  std::optional<double> retrograde_slope_error, halide_slope_error;
  bool integers = false;  // all outputs are
  double bytes = 0, operations = 0;
};

// The largest |a - b| / max(|b|, scale) over all elements, where scale is the root mean square of
// b's output: a small difference of large numbers counts by what it was made from. Infinite when
// shapes differ or a NaN stands on one side alone.
double max_relative_error(const std::vector<Values>& a, const std::vector<Values>& b);
// Whether a worker of ours, started for the most threads, gives the same bits with any number of them.
bool has_same_bits_on(const std::vector<int>& threads, Worker& worker,
                      const std::filesystem::path& scratch);
// The largest max_relative_error for which both sides have computed the same.
double tolerance(const PairResult& result);
// The slope error from which a gradient counts as wrong.
inline constexpr double wrong_slope = 0.02;

// The two workers of one kernel.
class Pair {
 public:
  Pair(const Job& job, const std::filesystem::path& programs);
  Pair(const Job& job, const WorkerCommand& retrograde, const WorkerCommand& halide);

  // One run of each, the one that goes first changing from time to time. Milliseconds of ours.
  double run();
  PairResult result(const std::filesystem::path& scratch);
  // Of gradients that have run: how far each is from differences of the program in a library.
  void check_slopes(PairResult& result, const std::filesystem::path& primal);
  // Ours, for what is not asked of both.
  Worker& retrograde() { return retrograde_; }

 private:
  void warm_up();

  Job job_;
  Worker retrograde_, halide_;
  std::vector<double> retrograde_ms_, halide_ms_;
};

}  // namespace bench

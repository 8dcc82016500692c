// pair.cpp -- see pair.h.
#include "pair.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

namespace bench {

namespace {

double quantile(const std::vector<double>& sorted, double q) {
  const double at = q * static_cast<double>(sorted.size() - 1);
  const size_t below = static_cast<size_t>(at);
  const size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (double v : values) sum += std::isfinite(v) ? v * v : 0;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

double relative_error(double a, double b, double scale) {
  if (a == b || (std::isnan(a) && std::isnan(b))) return 0;
  const double error = std::abs(a - b) / std::max(std::abs(b), scale);
  return std::isnan(error) ? std::numeric_limits<double>::infinity() : error;
}

// Threads of the side that has just run keep spinning for a moment.
void let_threads_rest() { std::this_thread::sleep_for(std::chrono::microseconds(500)); }

}  // namespace

Timing timing_of(std::vector<double> milliseconds) {
  std::sort(milliseconds.begin(), milliseconds.end());
  return {quantile(milliseconds, 0.5), milliseconds.front(),
          quantile(milliseconds, 0.75) - quantile(milliseconds, 0.25)};
}

double max_relative_error(const std::vector<Values>& a, const std::vector<Values>& b) {
  double most = 0;
  if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
  for (size_t output = 0; output < a.size(); output++) {
    const std::vector<double>&u = a[output].elements, &v = b[output].elements;
    if (u.size() != v.size() || u.empty()) return std::numeric_limits<double>::infinity();
    const double scale = root_mean_square(v);
    for (size_t i = 0; i < u.size(); i++) most = std::max(most, relative_error(u[i], v[i], scale));
  }
  return most;
}

bool has_same_bits_on(const std::vector<int>& threads, Worker& worker,
                      const std::filesystem::path& scratch) {
  std::vector<Values> first;
  for (const int n : threads) {
    worker.set_threads(n);
    worker.run();
    std::vector<Values> found = worker.outputs(scratch);
    if (first.empty()) first = found;
    for (size_t i = 0; i < first.size(); i++) {
      const std::vector<double>&a = first[i].elements, &b = found.at(i).elements;
      if (a.size() != b.size() || std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) != 0)
        return false;
    }
  }
  return true;
}

double tolerance(const PairResult& result) { return result.integers ? 0 : 1e-4; }

Pair::Pair(const Job& job, const std::filesystem::path& programs)
    : job_(job),
      retrograde_(Side::Retrograde, job, programs),
      halide_(Side::Halide, job, programs) {
  warm_up();
}

Pair::Pair(const Job& job, const WorkerCommand& retrograde, const WorkerCommand& halide)
    : job_(job),
      retrograde_(Side::Retrograde, retrograde, job.threads),
      halide_(Side::Halide, halide, job.threads) {
  warm_up();
}

// The first run of a process creates its threads and touches its memory.
void Pair::warm_up() {
  retrograde_.run();
  halide_.run();
}

double Pair::run() {
  const bool ours_first = retrograde_ms_.size() % 2 == 0;
  auto run_one = [](Worker& worker, std::vector<double>& times) {
    let_threads_rest();
    times.push_back(worker.run() * 1e3);
  };
  if (ours_first) run_one(retrograde_, retrograde_ms_);
  run_one(halide_, halide_ms_);
  if (!ours_first) run_one(retrograde_, retrograde_ms_);
  return retrograde_ms_.back();
}

void Pair::check_slopes(PairResult& result, const std::filesystem::path& primal) {
  result.retrograde_slope_error = retrograde_.slope_error(primal);
  result.halide_slope_error = halide_.slope_error(primal);
}

PairResult Pair::result(const std::filesystem::path& scratch) {
  PairResult result;
  result.kernel = job_.kernel;
  result.threads = job_.threads;
  if (!retrograde_ms_.empty()) result.retrograde = timing_of(retrograde_ms_);
  if (!halide_ms_.empty()) result.halide = timing_of(halide_ms_);
  result.retrograde_compile_ms = retrograde_.compile_seconds * 1e3;
  result.halide_compile_ms = halide_.compile_seconds * 1e3;
  result.retrograde_memory = retrograde_.memory();
  result.halide_memory = halide_.memory();
  const std::vector<Values> ours = retrograde_.outputs(scratch), theirs = halide_.outputs(scratch);
  result.max_relative_error = max_relative_error(ours, theirs);
  result.integers = std::all_of(ours.begin(), ours.end(), [](auto& o) { return o.integers; });
  if (job_.is_gradient && !(result.max_relative_error <= tolerance(result))) {
    result.retrograde_slope_error = retrograde_.slope_error();
    result.halide_slope_error = halide_.slope_error();
  }
  result.bytes = retrograde_.bytes;
  result.operations = retrograde_.operations;
  return result;
}

}  // namespace bench

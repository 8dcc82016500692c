// compare.cpp -- see compare.h.
#include "compare.h"

#include <algorithm>
#include <chrono>

#include "cases.h"

namespace programs {

namespace {

// Runs until the time limit; a round is one run of each side.
void run_rounds(bench::Pair& pair, const Limits& limits) {
  const auto start = std::chrono::steady_clock::now();
  const auto used = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  for (int round = 0; round < limits.least_rounds || used() < limits.seconds; round++) pair.run();
}

}  // namespace

Result compare(const std::string& name, const Toolchains& toolchains, const Limits& limits,
               const std::filesystem::path& worker, const std::filesystem::path& scratch,
               void (*say)(const std::string&)) {
  Result result;
  result.name = name;
  try {
    const Library ours = toolchains.retrograde.build(name, toolchains.reuse_retrograde);
    const Library theirs = toolchains.halide.build(name, toolchains.reuse_halide);
    const Program program = read_cases(ours.cases);
    result.tolerance = program.tolerance;
    result.retrograde_compile_ms = ours.compile_ms;
    result.halide_compile_ms = theirs.compile_ms;
    result.retrograde_compile_mb = ours.compile_peak_mb;
    result.halide_compile_mb = theirs.compile_peak_mb;
    for (size_t i = 0; i < std::min(limits.most_sizes, program.cases.size()); i++) {
      const Case& c = program.cases[i];
      bench::Job job;
      job.kernel = name;
      job.threads = c.threads ? c.threads : limits.threads;
      bench::Pair pair(job, {worker, {ours.path, ours.cases, std::to_string(i)}},
                       {worker, {theirs.path, ours.cases, std::to_string(i)}});
      run_rounds(pair, limits);
      bench::PairResult measured = pair.result(scratch);
      if (program.gradients > 0)
        pair.check_slopes(measured,
                          toolchains.halide.build_primal(name, toolchains.reuse_halide).path);
      result.cases.push_back(measured);
      result.labels.push_back(c.label);
      say(case_row(result, i));
    }
  } catch (const std::exception& error) {
    result.failure = error.what();
  }
  return result;
}

}  // namespace programs

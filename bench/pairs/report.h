// report.h -- prints a line for each kernel while the benchmark runs, then means and targets; writes the same as JSON.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "machine.h"
#include "pair.h"

namespace bench {

std::string table_head(const Machine& machine);
std::string table_row(const PairResult& result, const Machine& machine);

struct Target {
  std::string what;
  double value = 0, limit = 0;
  bool at_least = false;  // else at most
  bool met() const { return at_least ? value >= limit : value <= limit; }
};
// Over the kernels that ran on both sides; targets whose kernels did not run are left out.
std::vector<Target> targets(const std::vector<PairResult>& results, const Machine& machine);
std::string table_foot(const std::vector<PairResult>& results, const Machine& machine);

// Whether it failed or the two sides differ, unless differences show that our gradient is right and Halide's is wrong.
bool is_wrong(const PairResult& result);

void write_json(const std::filesystem::path& path, const std::vector<PairResult>& results,
                const Machine& machine);

}  // namespace bench

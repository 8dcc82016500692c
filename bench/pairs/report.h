// report.h -- what the benchmark says: a line for each kernel while it runs, then means and
// targets, and the same as JSON.
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

// It failed, or the two sides differ; but not when differences say that ours is right and Halide's
// is not.
bool is_wrong(const PairResult& result);

void write_json(const std::filesystem::path& path, const std::vector<PairResult>& results,
                const Machine& machine);

}  // namespace bench

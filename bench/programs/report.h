// report.h -- prints a line for each program at each size while `programs` runs, a line for the program, then means;
// writes the same as JSON.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "../pairs/pair.h"

namespace programs {

// A program on both sides: one pair for each size that ran.
struct Result {
  std::string name, failure;  // if empty, all other fields are valid
  std::vector<bench::PairResult> cases;
  std::vector<std::string> labels;
  double tolerance = 0;
  double retrograde_compile_ms = 0, halide_compile_ms = 0;
  double retrograde_compile_mb = 0, halide_compile_mb = 0;
};

double run_ratio(const Result& result);  // geometric mean over the sizes
double compile_ratio(const Result& result);
bool is_wrong(const Result& result);  // whether it failed or the two sides differ

std::string table_head();
std::string case_row(const Result& result, size_t which);
std::string program_row(const Result& result);
std::string table_foot(const std::vector<Result>& results);
void write_json(const std::filesystem::path& path, const std::vector<Result>& results);

}  // namespace programs

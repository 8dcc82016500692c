// report.cpp -- see report.h.
#include "report.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/files.h"
#include "pairs/figures.h"

namespace programs {

namespace {

using bench::completed;
using bench::formatted;
using bench::geometric_mean;

// If gradients disagree, differences decide whether ours is right.
bool differs(const Result& result, const bench::PairResult& r) {
  const double most = result.tolerance > 0 ? result.tolerance : bench::tolerance(r);
  if (r.max_relative_error <= most) return false;
  return !r.retrograde_slope_error || !(*r.retrograde_slope_error <= bench::wrong_slope);
}

nlohmann::json entry(const Result& result, size_t which) {
  const bench::PairResult& r = result.cases[which];
  nlohmann::json e{{"size", result.labels[which]},
                   {"threads", r.threads},
                   {"retrograde_ms", r.retrograde.median},
                   {"halide_ms", r.halide.median},
                   {"run_ratio", bench::run_ratio(r)},
                   {"retrograde_min_ms", r.retrograde.least},
                   {"halide_min_ms", r.halide.least},
                   {"min_ratio", r.retrograde.least / r.halide.least},
                   {"retrograde_spread_ms", r.retrograde.spread},
                   {"halide_spread_ms", r.halide.spread},
                   {"retrograde_run_mb", r.retrograde_memory.run_mb},
                   {"halide_run_mb", r.halide_memory.run_mb},
                   {"max_relative_error", r.max_relative_error},
                   {"differs", differs(result, r)},
                   {"bytes", r.bytes}};
  if (r.retrograde_slope_error) {
    e["retrograde_slope_error"] = *r.retrograde_slope_error;
    e["halide_slope_error"] = *r.halide_slope_error;
  }
  return e;
}

nlohmann::json entry(const Result& result) {
  nlohmann::json e{{"program", result.name}, {"cases", nlohmann::json::array()}};
  if (!result.failure.empty()) {
    e["failure"] = result.failure;
    return e;
  }
  e["run_ratio"] = run_ratio(result);
  e["compile_ratio"] = compile_ratio(result);
  e["retrograde_compile_ms"] = result.retrograde_compile_ms;
  e["halide_compile_ms"] = result.halide_compile_ms;
  e["retrograde_compile_peak_mb"] = result.retrograde_compile_mb;
  e["halide_compile_peak_mb"] = result.halide_compile_mb;
  for (size_t i = 0; i < result.cases.size(); i++) e["cases"].push_back(entry(result, i));
  return e;
}

}  // namespace

double run_ratio(const Result& result) {
  return geometric_mean(result.cases,
                        [](const bench::PairResult& r) { return bench::run_ratio(r); });
}
double compile_ratio(const Result& result) {
  return result.retrograde_compile_ms / result.halide_compile_ms;
}

bool is_wrong(const Result& result) {
  return !result.failure.empty() ||
         std::any_of(result.cases.begin(), result.cases.end(),
                     [&](const bench::PairResult& r) { return differs(result, r); });
}

std::string table_head() {
  return formatted("%-24s %-7s %2s %12s %12s %7s %8s %10s\n", "program", "size", "T", "Retrograde",
                   "Halide ms", "ratio", "of least", "error");
}

std::string case_row(const Result& result, size_t which) {
  const bench::PairResult& r = result.cases[which];
  std::string remark = differs(result, r) ? "  DIFFERS" : "";
  if (r.retrograde_slope_error)
    remark += formatted("  from differences: ours by %.1e, Halide's by %.1e; %.0f / %.0f MB",
                        *r.retrograde_slope_error, *r.halide_slope_error,
                        r.retrograde_memory.run_mb, r.halide_memory.run_mb);
  return formatted("%-24s %-7s %2d %12.4f %12.4f %7.3f %8.3f %10.1e", result.name.c_str(),
                   result.labels[which].c_str(), r.threads, r.retrograde.median, r.halide.median,
                   bench::run_ratio(r), r.retrograde.least / r.halide.least, r.max_relative_error) +
         remark + "\n";
}

std::string program_row(const Result& result) {
  if (!result.failure.empty())
    return formatted("%-24s FAILED: ", result.name.c_str()) + result.failure + "\n";
  return formatted("%-24s ----    run %.3f   compile %.0f / %.0f ms = %.3f   %.0f / %.0f MB\n",
                   result.name.c_str(), run_ratio(result), result.retrograde_compile_ms,
                   result.halide_compile_ms, compile_ratio(result), result.retrograde_compile_mb,
                   result.halide_compile_mb);
}

std::string table_foot(const std::vector<Result>& all) {
  const std::vector<Result> results = completed(all);
  if (results.empty()) return "\nno program ran\n";
  const auto by_ratio = [](const Result& a, const Result& b) {
    return run_ratio(a) < run_ratio(b);
  };
  const Result& worst = *std::max_element(results.begin(), results.end(), by_ratio);
  const auto wrong = std::count_if(all.begin(), all.end(), is_wrong);
  std::string out = "\n";
  out += formatted("run time, geometric mean of %zu programs   %.3f\n", results.size(),
                   geometric_mean(results, run_ratio));
  out += formatted("run time, largest ratio                     %.3f (%s)\n", run_ratio(worst),
                   worst.name.c_str());
  out += formatted("compile time, geometric mean                %.3f\n",
                   geometric_mean(results, compile_ratio));
  out += formatted("%zu programs, %ld failed or different\n", all.size(), long{wrong});
  for (const Result& r : all) {
    if (is_wrong(r)) out += "  " + r.name + "\n";
  }
  return out;
}

void write_json(const std::filesystem::path& path, const std::vector<Result>& results) {
  nlohmann::json list = nlohmann::json::array();
  for (const Result& r : results) list.push_back(entry(r));
  const std::vector<Result> done = completed(results);
  const nlohmann::json all{{"run_ratio", geometric_mean(done, run_ratio)},
                           {"compile_ratio", geometric_mean(done, compile_ratio)},
                           {"programs", list}};
  apps::write_file(path, all.dump(2) + "\n");
}

}  // namespace programs

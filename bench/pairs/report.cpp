// report.cpp -- see report.h.
#include "report.h"

#include <nlohmann/json.hpp>

#include "common/files.h"
#include "figures.h"

namespace bench {

namespace {

double compile_ratio(const PairResult& r) { return r.retrograde_compile_ms / r.halide_compile_ms; }

double percent_of_bound(const PairResult& r, const Machine& machine) {
  return 100e3 * bound_seconds(machine, r.threads, r.bytes, r.operations) / r.retrograde.median;
}
double percent_of_peak(const PairResult& r, const Machine& machine) {
  return 100e3 * r.operations / machine.flops(r.threads) / r.retrograde.median;
}

// The remark after the error in the table.
std::string remark(const PairResult& r) {
  if (r.max_relative_error <= tolerance(r)) return "";
  if (!r.halide_slope_error) return "  DIFFERS";
  return formatted("  %s, from differences: ours by %.1e, Halide's by %.1e",
                   is_wrong(r) ? "DIFFERS" : "Halide's is wrong", *r.retrograde_slope_error,
                   *r.halide_slope_error);
}

nlohmann::json entry(const PairResult& r, const Machine& machine) {
  nlohmann::json e{{"kernel", r.kernel}, {"threads", r.threads}};
  if (!r.failure.empty()) {
    for (const char* field :
         {"retrograde_ms", "halide_ms", "run_ratio", "compile_ratio", "retrograde_peak_mb",
          "halide_peak_mb", "percent_of_bound", "max_relative_error"})
      e[field] = nullptr;
    e["failure"] = r.failure;
    return e;
  }
  e["retrograde_ms"] = r.retrograde.median;
  e["halide_ms"] = r.halide.median;
  e["run_ratio"] = run_ratio(r);
  e["compile_ratio"] = compile_ratio(r);
  e["retrograde_peak_mb"] = r.retrograde_memory.peak_mb;
  e["halide_peak_mb"] = r.halide_memory.peak_mb;
  e["percent_of_bound"] = percent_of_bound(r, machine);
  e["max_relative_error"] = r.max_relative_error;
  if (r.halide_slope_error) {
    e["retrograde_slope_error"] = *r.retrograde_slope_error;
    e["halide_slope_error"] = *r.halide_slope_error;
  }
  e["retrograde_min_ms"] = r.retrograde.least;
  e["halide_min_ms"] = r.halide.least;
  e["retrograde_spread_ms"] = r.retrograde.spread;
  e["halide_spread_ms"] = r.halide.spread;
  e["retrograde_compile_ms"] = r.retrograde_compile_ms;
  e["halide_compile_ms"] = r.halide_compile_ms;
  e["retrograde_run_mb"] = r.retrograde_memory.run_mb;
  e["halide_run_mb"] = r.halide_memory.run_mb;
  e["bytes"] = r.bytes;
  e["operations"] = r.operations;
  e["measured_bytes_per_second"] = machine.bytes_per_second;
  e["measured_flops"] = machine.flops(r.threads);
  return e;
}

}  // namespace

bool is_wrong(const PairResult& result) {
  if (!result.failure.empty()) return true;
  if (result.max_relative_error <= tolerance(result)) return false;
  return !result.retrograde_slope_error || !(*result.retrograde_slope_error <= wrong_slope) ||
         *result.halide_slope_error <= wrong_slope;
}

std::string table_head(const Machine& machine) {
  return formatted(
             "%d threads; triad %.1f GB/s; FMA peak %.1f GFLOP/s on one core, %.1f on all\n\n",
             machine.threads, machine.bytes_per_second / 1e9, machine.flops_one_thread / 1e9,
             machine.flops_all_threads / 1e9) +
         formatted("%-22s %2s %18s %18s %6s %16s %7s %13s %7s %9s\n", "kernel", "T",
                   "Retrograde ms", "Halide ms", "ratio", "compile ms", "ratio", "peak MB",
                   "% bound", "error");
}

std::string table_row(const PairResult& r, const Machine& machine) {
  if (!r.failure.empty())
    return formatted("%-22s %2d FAILED: ", r.kernel.c_str(), r.threads) + r.failure + "\n";
  return formatted(
             "%-22s %2d %8.2f [%.2f+%.2f] %8.2f [%.2f+%.2f] %6.3f %7.0f %8.0f %7.3f %6.0f %6.0f "
             "%7.1f "
             "%9.1e",
             r.kernel.c_str(), r.threads, r.retrograde.median, r.retrograde.least,
             r.retrograde.spread, r.halide.median, r.halide.least, r.halide.spread, run_ratio(r),
             r.retrograde_compile_ms, r.halide_compile_ms, compile_ratio(r),
             r.retrograde_memory.peak_mb, r.halide_memory.peak_mb, percent_of_bound(r, machine),
             r.max_relative_error) +
         remark(r) + "\n";
}

std::vector<Target> targets(const std::vector<PairResult>& all, const Machine& machine) {
  const std::vector<PairResult> results = completed(all);
  if (results.empty()) return {};
  double slowest = 0;
  for (const PairResult& r : results) slowest = std::max(slowest, run_ratio(r));
  std::vector<Target> out{
      {"run time, geometric mean of ratios", geometric_mean(results, run_ratio), 0.95},
      {"run time, largest ratio", slowest, 1.10},
      {"compile time, geometric mean of ratios", geometric_mean(results, compile_ratio), 0.5}};
  for (const PairResult& r : results) {
    if (r.kernel == "stencil_chain")
      out.push_back({"compile time of stencil_chain, ratio", compile_ratio(r), 0.2});
    if (r.kernel == "matrix_multiply")
      out.push_back({formatted("matrix_multiply on %d, %% of FMA peak", r.threads),
                     percent_of_peak(r, machine), 80, true});
  }
  return out;
}

std::string table_foot(const std::vector<PairResult>& results, const Machine& machine) {
  std::string out = "\n";
  for (const Target& target : targets(results, machine))
    out += formatted("%-46s %8.3f  target %s %g: %s\n", target.what.c_str(), target.value,
                     target.at_least ? ">=" : "<=", target.limit, target.met() ? "met" : "MISSED");
  const auto wrong = std::count_if(results.begin(), results.end(), is_wrong);
  out += formatted("%zu measurements, %ld failed or different\n", results.size(), long{wrong});
  return out;
}

void write_json(const std::filesystem::path& path, const std::vector<PairResult>& results,
                const Machine& machine) {
  nlohmann::json list = nlohmann::json::array();
  for (const PairResult& r : results) list.push_back(entry(r, machine));
  apps::write_file(path, list.dump(2) + "\n");
}

}  // namespace bench

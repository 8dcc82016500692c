// kernels_main.cpp -- compares run time, compile time and memory of forward pipelines and gradients with Halide 14's.
//
// Google Benchmark runs each kernel as one benchmark with manual time: an iteration is one run of each side. See
// README.md.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "common/files.h"
#include "common/process.h"
#include "pairs/command.h"
#include "pairs/machine.h"
#include "pairs/options.h"
#include "pairs/pair.h"
#include "pairs/report.h"

namespace bench {

namespace {

struct Session {
  Machine machine;
  std::filesystem::path programs, scratch;
  std::vector<PairResult> results;
};

void run_pair(benchmark::State& state, Session& session, const Job& job) {
  PairResult result;
  result.kernel = job.kernel;
  result.threads = job.threads;
  try {
    Pair pair(job, session.programs);
    for (auto _ : state) state.SetIterationTime(pair.run() / 1e3);
    result = pair.result(session.scratch);
    state.counters["halide_ms"] = result.halide.median;
  } catch (const WorkerError& error) {
    result.failure = error.what();
    state.SkipWithError(error.what());
  }
  session.results.push_back(result);
}

// Prints a row when a kernel is done.
class TableReporter : public benchmark::BenchmarkReporter {
 public:
  explicit TableReporter(const Session& session) : session_(session) {}
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>&) override {
    std::fputs(table_row(session_.results.back(), session_.machine).c_str(), stdout);
    std::fflush(stdout);
  }

 private:
  const Session& session_;
};

// Runs on all threads; the matrix multiplication also runs on one core.
std::vector<Job> jobs(const std::vector<std::string>& names, const Machine& machine) {
  std::vector<Job> out;
  for (const std::string& name : names) {
    if (name == "matrix_multiply" && machine.threads > 1) out.push_back({name, false, 1});
    out.push_back({name, false, machine.threads, is_gradient(name)});
  }
  return out;
}

int run(const Options& options) {
  Session session{measure_machine(), apps::program_folder(), options.output.parent_path(), {}};
  if (session.scratch.empty()) session.scratch = ".";
  apps::require_writable_folder(session.scratch);
  for (const Job& job : jobs(options.kernels, session.machine)) {
    benchmark::RegisterBenchmark(
        (job.kernel + "/threads:" + std::to_string(job.threads)).c_str(),
        [&session, job](benchmark::State& state) { run_pair(state, session, job); })
        ->UseManualTime()
        ->Iterations(options.rounds)
        ->Unit(benchmark::kMillisecond);
  }
  std::fputs(table_head(session.machine).c_str(), stdout);
  TableReporter reporter(session);
  benchmark::RunSpecifiedBenchmarks(&reporter);
  std::fputs(table_foot(session.results, session.machine).c_str(), stdout);
  write_json(options.output, session.results, session.machine);
  std::printf("report: %s\n", options.output.c_str());
  const auto& results = session.results;
  return std::any_of(results.begin(), results.end(), is_wrong) ? 1 : 0;
}

}  // namespace

}  // namespace bench

int main(int argc, char** argv) {
  return bench::run_benchmark("bench_kernels", [&] {
    benchmark::Initialize(&argc, argv);
    const auto options = bench::read_options(argc, argv);
    return options ? bench::run(*options) : 0;
  });
}

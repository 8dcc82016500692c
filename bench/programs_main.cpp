// programs_main.cpp -- programs as users write them for Halide, compiled ahead of time by Halide 14 and by Retrograde
// and run in turns: see README.md.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <thread>

#include "common/files.h"
#include "common/process.h"
#include "pairs/command.h"
#include "programs/compare.h"

namespace programs {

namespace {

const std::vector<std::string> program_names{
#define PROGRAM(name) #name,
#include "programs/list.def"
};
const std::vector<std::string> second_names{
#define SECOND(name) #name,
#include "programs/list.def"
};
const std::vector<std::string> gradient_names{
#define GRADIENT(name) #name,
#include "programs/list.def"
};

struct Options {
  std::vector<std::string> programs;
  bool second = false, gradients = false, quick = false, compile_only = false, reuse = false,
       reuse_halide = false;
  double seconds = 1;
  std::filesystem::path output = "programs.json";
};

std::vector<std::string> all_names() {
  std::vector<std::string> names = program_names;
  for (const auto& more : {second_names, gradient_names})
    names.insert(names.end(), more.begin(), more.end());
  return names;
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("--program", options.programs, "run this program; may be given several times");
  app.add_flag("--second", options.second,
               "run the second set instead, on which the compiler is not tuned");
  app.add_flag("--gradients", options.gradients,
               "run gradients instead, Halide's with Li2018, ours with the default schedule");
  app.add_flag("--quick", options.quick, "the smallest size of each, few runs");
  app.add_flag("--compile-only", options.compile_only,
               "only compile the libraries, for a later run with --reuse");
  app.add_flag("--reuse", options.reuse, "reuse the libraries of an earlier run");
  app.add_flag("--reuse-halide", options.reuse_halide, "reuse only Halide's libraries");
  app.add_option("--seconds", options.seconds, "time for the runs of each program at each size")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  app.add_option("--output", options.output, "the report, as JSON")->capture_default_str();
}

// Returns false if only help was requested.
bool read(int argc, char** argv, Options& options) {
  CLI::App app("Programs as users write them, compiled ahead of time by Halide 14 and Retrograde.");
  add_options(app, options);
  if (!bench::parse_command_line(app, argc, argv)) return false;
  bench::require_known("program", options.programs, all_names());
  if (options.programs.empty())
    options.programs = options.gradients ? gradient_names
                       : options.second  ? second_names
                                         : program_names;
  return true;
}

void say(const std::string& line) {
  std::fputs(line.c_str(), stdout);
  std::fflush(stdout);
}

int run(const Options& options) {
  std::filesystem::path folder = options.output.parent_path();
  folder = (folder.empty() ? std::filesystem::path(".") : folder) / "programs";
  apps::require_writable_folder(folder);
  const std::filesystem::path here = apps::program_folder();
  const Toolchains toolchains{{bench::Side::Retrograde, here, folder},
                              {bench::Side::Halide, here, folder},
                              options.reuse,
                              options.reuse || options.reuse_halide};
  Limits limits;
  limits.threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  limits.seconds = options.quick ? 0 : options.seconds;
  if (options.quick) limits.most_sizes = 1;
  if (options.compile_only) limits.most_sizes = 0;
  if (!options.compile_only) say(table_head());
  std::vector<Result> results;
  for (const std::string& name : options.programs) {
    results.push_back(
        compare(name, toolchains, limits, here / "bench_programs_worker", folder, say));
    say(program_row(results.back()));
  }
  say(table_foot(results));
  write_json(options.output, results);
  say("report: " + options.output.string() + "\n");
  return std::any_of(results.begin(), results.end(), is_wrong) ? 1 : 0;
}

}  // namespace

}  // namespace programs

int main(int argc, char** argv) {
  return bench::run_benchmark("bench_programs", [&] {
    programs::Options options;
    return programs::read(argc, argv, options) ? programs::run(options) : 0;
  });
}

// builder_main.cpp -- compiles one program ahead of time. The same source is built with Halide 14 and with Retrograde,
// together with all programs.
//
//   builder NAME FOLDER [PARAM=VALUE...]
//       writes FOLDER/NAME.o and NAME.cases, and prints "compiled SECONDS PEAK_MB"
//   builder -r FOLDER
//       writes FOLDER/runtime.o, the compiler's own runtime
//
// SECONDS: from the command line of a generator to its object file, after a trivial generator has made the compiler do
// its one-time initialisation. Failures are reported on standard error.
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <thread>

#ifdef BENCH_RETROGRADE
#include "generator/command_line.h"
#endif
#include "program.h"

namespace {

class Trivial : public Halide::Generator<Trivial> {
 public:
  Output<Func> result{"result", Int(32), 1};
  void generate() {
    Halide::Var x("x");
    result(x) = x;
  }
};

// Halide 14 mistakes recent AMD processors for ones with AMX, and its code would not run. Ours leaves AMX out too, so
// that both sides have the same target.
std::string target() {
  return Halide::get_host_target()
      .without_feature(Halide::Target::AVX512_SapphireRapids)
      .to_string();
}

void run_command(std::vector<std::string> words) {
  words.insert(words.begin(), "builder");
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  if (Halide::Internal::generate_filter_main(static_cast<int>(arguments.size()), arguments.data(),
                                             std::cerr) != 0)
    throw std::runtime_error("the generator failed");
}

void generate(const std::string& name, const std::string& folder,
              const std::vector<std::string>& params) {
  std::vector<std::string> words = {
      "-g", name, "-f", name, "-o", folder, "-e", "object", "target=" + target() + "-no_runtime"};
  words.insert(words.end(), params.begin(), params.end());
  run_command(words);
}

const programs::Registered& find(const std::string& name) {
  for (const programs::Registered& each : programs::registered()) {
    if (each.program.name == name) return each;
  }
  throw std::runtime_error("there is no program \"" + name + "\"");
}

void build(const std::string& name, const std::string& folder,
           const std::vector<std::string>& more) {
  programs::Registered program = find(name);
  program.params.insert(program.params.end(), more.begin(), more.end());
#ifndef BENCH_RETROGRADE
  if (program.program.gradients > 0 && more.empty()) {
    const std::string threads = std::to_string(std::thread::hardware_concurrency());
    program.params.insert(program.params.begin(),
                          {"-p", BENCH_LI2018, "-s", "Li2018", "auto_schedule=true",
                           "machine_params=" + threads + ",16777216,40"});
  }
#endif
  programs::write_cases(folder + "/" + name + ".cases", program.program);
  generate("trivial", folder, {});
  const auto start = std::chrono::steady_clock::now();
  generate(name, folder, program.params);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  std::printf("compiled %.6f %.1f\n", seconds.count(), static_cast<double>(used.ru_maxrss) / 1024);
}

}  // namespace

HALIDE_REGISTER_GENERATOR(Trivial, trivial)

std::vector<programs::Registered>& programs::registered() {
  static std::vector<Registered> all;
  return all;
}

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s NAME|-r FOLDER [PARAM=VALUE...]\n", argv[0]);
    return 2;
  }
  try {
    if (argv[1] == std::string("-r"))
      run_command({"-r", "runtime", "-o", argv[2], "-e", "object", "target=" + target()});
    else
      build(argv[1], argv[2], {argv + 3, argv + argc});
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

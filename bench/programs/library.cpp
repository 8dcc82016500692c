// library.cpp -- see library.h.
#include "library.h"

#include <fstream>

#include "common/files.h"
#include "common/process.h"

namespace programs {

namespace {

// The output of a command; throws BuildError if it fails.
std::string output_of(const std::vector<std::string>& command) {
  const apps::Outcome outcome = apps::run_program(command);
  if (!outcome.started) throw BuildError("cannot run " + command[0]);
  if (outcome.status != 0) {
    const std::string status = "exit status " + std::to_string(outcome.status);
    throw BuildError(outcome.output.empty() ? status : outcome.output + " (" + status + ")");
  }
  return outcome.output;
}

}  // namespace

Toolchain::Toolchain(bench::Side side, const std::filesystem::path& programs,
                     const std::filesystem::path& folder)
    : side_(side) {
  const std::string name = side == bench::Side::Halide ? "halide" : "retrograde";
  builder_ = programs / ("bench_programs_" + name);
  folder_ = folder / name;
  apps::require_writable_folder(folder_);
  if (side == bench::Side::Halide && !std::filesystem::exists(file("runtime", ".o")))
    output_of({builder_, "-r", folder_});
}

// The builder's last line, which is kept beside the library, contains the times.
Library Toolchain::read(const std::string& name) const {
  Library library{file(name, ".so"), file(name, ".cases")};
  std::ifstream log(file(name, ".log"));
  for (std::string line; std::getline(log, line);) {
    double seconds = 0;
    if (std::sscanf(line.c_str(), "compiled %lf %lf", &seconds, &library.compile_peak_mb) == 2)
      library.compile_ms = 1e3 * seconds;
  }
  return library;
}

void Toolchain::link(const std::string& name, const std::filesystem::path& runtime) const {
  std::vector<std::string> command = {BENCH_CXX, "-shared", "-o", file(name, ".so"),
                                      file(name, ".o")};
  if (side_ == bench::Side::Halide)
    command.push_back(runtime);
  else
    command.insert(command.end(), {BENCH_RETROGRADE_RUNTIME, "-lsleef"});
  command.insert(command.end(), {"-lpthread", "-ldl", "-lm"});
  output_of(command);
}

Library Toolchain::build(const std::string& name, bool reuse) const {
  if (reuse && std::filesystem::exists(file(name, ".so"))) return read(name);
  std::filesystem::remove(file(name, ".so"));
  apps::write_file(file(name, ".log"), output_of({builder_, name, folder_}));
  link(name, file("runtime", ".o"));
  return read(name);
}

Library Toolchain::build_primal(const std::string& name, bool reuse) const {
  Toolchain primal = *this;
  primal.folder_ /= "primal";
  apps::require_writable_folder(primal.folder_);
  if (reuse && std::filesystem::exists(primal.file(name, ".so"))) return primal.read(name);
  output_of({builder_, name, primal.folder_, "primal=true"});
  primal.link(name, file("runtime", ".o"));
  return primal.read(name);
}

}  // namespace programs

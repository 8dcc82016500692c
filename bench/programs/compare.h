// compare.h -- one program on both sides: compiled, run at each of its sizes in turn, compared.
#pragma once

#include <string>

#include "library.h"
#include "report.h"

namespace programs {

struct Limits {
  size_t most_sizes = 3;
  int least_rounds = 7;
  double seconds = 1;  // of runs at each size, as many as fit, but `least_rounds`
  int threads = 1;     // what a case means by all
};

struct Toolchains {
  Toolchain retrograde, halide;
  bool reuse_retrograde = false, reuse_halide = false;  // what an earlier run has compiled
};

// Never throws for what the program does: its result has the failure. `say` gets a line for each
// size.
Result compare(const std::string& name, const Toolchains& toolchains, const Limits& limits,
               const std::filesystem::path& worker, const std::filesystem::path& scratch,
               void (*say)(const std::string&));

}  // namespace programs

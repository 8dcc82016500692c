// compare.h -- compares one program on both sides: compiles it, and runs it at each of its sizes in turn.
#pragma once

#include <string>

#include "library.h"
#include "report.h"

namespace programs {

struct Limits {
  size_t most_sizes = 3;
  int least_rounds = 7;
  double seconds = 1;  // time for runs at each size, with at least `least_rounds` runs
  int threads = 1;     // number of threads for cases that use all
};

struct Toolchains {
  Toolchain retrograde, halide;
  bool reuse_retrograde = false,
       reuse_halide = false;  // reuse libraries that an earlier run compiled
};

// Does not throw for errors of the program; the result contains them. `say` is called with a line for each size.
Result compare(const std::string& name, const Toolchains& toolchains, const Limits& limits,
               const std::filesystem::path& worker, const std::filesystem::path& scratch,
               void (*say)(const std::string&));

}  // namespace programs

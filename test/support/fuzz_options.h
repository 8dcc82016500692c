// The command line that fuzzers share: which seeds, how long, what to print.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <string>

namespace retrograde::fuzz {

struct FuzzOptions {
  uint64_t seed = 1000, count = 100;
  double seconds = 1e9;
  bool shrink = true, print = false, refusals = false;

  // Takes argv[i], and its value behind it, if it is one of the shared arguments: false otherwise,
  // and when the value is missing. `i` is left on the last argument taken.
  bool take(int& i, int argc, char** argv) {
    const std::string name = argv[i];
    if (name == "--no-shrink") {
      shrink = false;
    } else if (name == "--print") {
      print = true;
    } else if (name == "--refusals") {
      refusals = true;
    } else if (i + 1 >= argc) {
      return false;
    } else if (name == "--seed" || name == "--from") {
      seed = std::strtoull(argv[++i], nullptr, 10);
      if (name == "--seed") count = 1;
    } else if (name == "--count") {
      count = std::strtoull(argv[++i], nullptr, 10);
    } else if (name == "--seconds") {
      seconds = std::strtod(argv[++i], nullptr);
      count = UINT64_MAX;
    } else {
      return false;
    }
    return true;
  }
};

}  // namespace retrograde::fuzz

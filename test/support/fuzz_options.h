// The command line that fuzzers share: which seeds, how long, what to print.
#pragma once

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <string>
#include <system_error>

namespace retrograde::fuzz {

struct FuzzOptions {
  uint64_t seed = 1000, count = 100;
  double seconds = 1e9;
  bool shrink = true, print = false, refusals = false;

  // Takes argv[i], and its value behind it, if it is one of the shared arguments: false otherwise,
  // and when the value is missing or no number. `i` is left on the last argument looked at.
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
      if (name == "--seed") count = 1;
      return is_number(argv[++i], seed);
    } else if (name == "--count") {
      return is_number(argv[++i], count);
    } else if (name == "--seconds") {
      count = UINT64_MAX;
      return is_number(argv[++i], seconds);
    } else {
      return false;
    }
    return true;
  }

  // Nobody takes a run of nothing for a clean one.
  static bool has_tried(uint64_t programs) {
    if (programs == 0) std::puts("no program was tried: nothing is known");
    return programs > 0;
  }

  // All of the text, from its first digit on.
  template <class T>
  static bool is_number(const std::string& text, T& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
  }
};

}  // namespace retrograde::fuzz

// A 128-bit key of what a lowered function computes. Functions with equal keys differ at most in names of variables and
// in the number at the end of allocation names.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "ir/lowered_function.h"

namespace retrograde::jit {

struct Fingerprint {
  uint64_t low = 0x243f6a8885a308d3u, high = 0x13198a2e03707344u;
  void add(uint64_t word);
  void add(std::string_view text);
  friend bool operator==(const Fingerprint&, const Fingerprint&) = default;
};

Fingerprint fingerprint(const ir::LoweredFunction& function);
// The complete input of the fingerprint, for use with a stronger hash.
std::string fingerprint_text(const ir::LoweredFunction& function);

}  // namespace retrograde::jit

// A 128-bit key of what a lowered function computes. Equal keys mean the same program up to the
// names of variables and the number at the end of allocations' names.
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
// All that the fingerprint is made of, for a stronger hash.
std::string fingerprint_text(const ir::LoweredFunction& function);

}  // namespace retrograde::jit

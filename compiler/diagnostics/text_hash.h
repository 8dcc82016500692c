// text_hash.h -- a hash of text that is the same on all machines, for file names and table keys.
#pragma once

#include <cstdint>
#include <string_view>

namespace retrograde {

// The 64-bit FNV-1a hash.
constexpr uint64_t text_hash(std::string_view text) {
  uint64_t hash = 14695981039346656037u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  return hash;
}

}  // namespace retrograde

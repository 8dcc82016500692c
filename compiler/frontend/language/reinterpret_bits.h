// reinterpret_bits.h -- reinterprets the bits of a C++ value as another type of the same size.
#pragma once

#include <bit>
#include <type_traits>

namespace retrograde::internal {

// The bits of a C++ value as a value of another type of the same size.
//   uint32_t bits = reinterpret_bits<uint32_t>(1.0f);   // 0x3f800000
template <typename To, typename From>
To reinterpret_bits(const From& from) {
  static_assert(sizeof(To) == sizeof(From), "both types have one size");
  static_assert(std::is_trivially_copyable_v<To> && std::is_trivially_copyable_v<From>,
                "a type whose bits are its value");
  return std::bit_cast<To>(from);
}

}  // namespace retrograde::internal

namespace retrograde {
using internal::reinterpret_bits;
}

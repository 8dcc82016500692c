// Counter-based random numbers for Op::random: a pure function of the seed words. Results are the
// same in the interpreter and in machine code, under every schedule and number of threads.
//
// Each word is mixed into a 32-bit state by xor and a bijective hash (xorshift, multiply, twice),
// so words that differ in one bit give unrelated numbers. The hash is the least biased one that
// TheIronBorn found with C. Wellons' hash-prospector: [16 21f0aaad 15 735a2d97 15] of its issue 19
// (2022), in the form of MurmurHash3's final step (A. Appleby). The constant added before each step
// is 2^32 over the golden ratio (Knuth, The Art of Computer Programming 3, 6.4).
#pragma once

#include <cstdint>

namespace retrograde::ir {

inline constexpr uint32_t random_seed = 0x9e3779b9u;
inline constexpr uint32_t random_multiplier_1 = 0x21f0aaadu;
inline constexpr uint32_t random_multiplier_2 = 0x735a2d97u;

inline uint32_t random_mix(uint32_t state, uint32_t word) {
  state = (state ^ word) + random_seed;
  state = (state ^ (state >> 16)) * random_multiplier_1;
  state = (state ^ (state >> 15)) * random_multiplier_2;
  return state ^ (state >> 15);
}

// The seed words are the low 32 bits of each integer argument.
inline uint32_t random_bits(const uint32_t* words, int count) {
  uint32_t state = random_seed;
  for (int i = 0; i < count; i++) state = random_mix(state, words[i]);
  return state;
}

// Converts to the call's type: floats in [0, 1) use the upper 24 bits; integers of up to 32 bits
// the low bits.
inline float random_float(uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

}  // namespace retrograde::ir

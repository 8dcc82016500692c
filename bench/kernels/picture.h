// picture.h -- the input values of benchmarks. They depend only on the position, so both sides have the same.
#pragma once

#include <cstdint>

namespace kernels {

// C. Wellons' lowbias32 (2018, "Prospecting for hash functions").
inline uint32_t scrambled(uint32_t n) {
  n = (n ^ (n >> 16)) * 0x7feb352du;
  n = (n ^ (n >> 15)) * 0x846ca68bu;
  return n ^ (n >> 16);
}

// Slopes and edges of several sizes, and a little noise: 0 <= value < 1.
inline double picture(int x, int y, int c) {
  const uint32_t ramp = static_cast<uint32_t>(x * 5 + y * 3 + c * 91) % 1024;
  const uint32_t wave = ramp < 512 ? ramp : 1023 - ramp;
  const uint32_t block = scrambled(static_cast<uint32_t>(x / 57 + y / 43 * 1031)) & 511;
  const uint32_t noise = scrambled(static_cast<uint32_t>(x + y * 8191 + c * 67108859)) & 255;
  return (wave + block + 0.25 * noise) / 1088.0;
}

}  // namespace kernels

// The reference for the function of gpu_generator.cpp, in plain C++. It sums integers, so results are exact.
#pragma once

#include <HalideBuffer.h>
#include <gtest/gtest.h>

namespace gpu_filter_testing {

using Halide::Runtime::Buffer;

inline Buffer<float, 2> input(int width, int height) {
  Buffer<float, 2> in(width, height);
  in.for_each_element([&](int x, int y) { in(x, y) = static_cast<float>((x * 7 + y * 13) % 32); });
  return in;
}

inline float expected(const Buffer<float, 2>& in, float gain, int x, int y) {
  float result = 0;
  for (int j = 0; j < in.height(); j++) result -= gain * in(x, j);
  for (const int j : {y - 1, y + 1}) {
    for (int i = x - 1; i <= x + 1; i++) {
      if (i >= 0 && i < in.width() && j >= 0 && j < in.height()) result += gain * in(i, j);
    }
  }
  return result;
}

// Checks elements that are on the host.
inline void expect_filtered(const Buffer<float, 2>& in, float gain, const Buffer<float, 2>& out) {
  for (int y = 0; y < out.height(); y++) {
    for (int x = 0; x < out.width(); x++)
      ASSERT_EQ(out(x, y), expected(in, gain, x, y)) << x << ", " << y;
  }
}

}  // namespace gpu_filter_testing

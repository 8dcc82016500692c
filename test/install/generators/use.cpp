// Calls the generated libraries and checks them in plain C++: values, and gradients against
// differences.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "HalideBuffer.h"
#include TONE_INFO
#include "tone.h"
#include "tone_gradient.h"
#include "tone_wide.h"

using Halide::Runtime::Buffer;

namespace {

static_assert(tone_argument_info().size() == 4 && tone_argument_info()[2].name == "gain");

constexpr int width = 37, height = 11;
constexpr float gain = 0.25f;

int clamp(int i, int n) { return i < 0 ? 0 : i >= n ? n - 1 : i; }

double expected(const Buffer<float>& in, const Buffer<float>& kernel, int x, int y) {
  const int taps = kernel.width(), radius = taps / 2;
  double sum = 0;
  for (int k = 0; k < taps; k++)
    sum += static_cast<double>(in(clamp(x + k - radius, width), y)) * kernel(k);
  return std::exp(sum * gain);
}

double loss(const Buffer<float>& in, const Buffer<float>& kernel, const Buffer<float>& weights) {
  double sum = 0;
  for (int y = 0; y < height; y++) {
    for (int x = 0; x < width; x++) sum += expected(in, kernel, x, y) * weights(x, y);
  }
  return sum;
}

void check(const char* what, double got, double want) {
  if (std::fabs(got - want) <= 2e-3 * (1 + std::fabs(want))) return;
  std::printf("%s is %g, %g by hand\n", what, got, want);
  std::exit(1);
}

void check_code(const char* what, int code) {
  if (code == 0) return;
  std::printf("%s returned %d\n", what, code);
  std::exit(1);
}

void check_values(const Buffer<float>& in, const Buffer<float>& kernel, const Buffer<float>& out) {
  for (int y = 0; y < height; y++) {
    for (int x = 0; x < width; x++) check("a value", out(x, y), expected(in, kernel, x, y));
  }
}

// The derivative by one element, by central differences in double.
double slope(Buffer<float>& in, Buffer<float>& kernel, const Buffer<float>& weights,
             float& element) {
  const float kept = element, step = 1e-2f;
  element = kept + step;
  const double above = loss(in, kernel, weights);
  element = kept - step;
  const double below = loss(in, kernel, weights);
  element = kept;
  return (above - below) / (2.0 * step);
}

}  // namespace

int main() {
  Buffer<float> in(width, height), out(width, height), weights(width, height);
  Buffer<float> kernel(3), wide_kernel(7);
  in.for_each_element([&](int x, int y) { in(x, y) = std::sin(0.3f * x + y); });
  weights.for_each_element([&](int x, int y) { weights(x, y) = std::cos(0.2f * x - y); });
  for (int i = 0; i < 3; i++) kernel(i) = 0.2f + 0.1f * i;
  for (int i = 0; i < 7; i++) wide_kernel(i) = 0.1f + 0.02f * i;

  check_code("tone", tone(in, kernel, gain, out));
  check_values(in, kernel, out);
  check_code("tone_wide", tone_wide(in, wide_kernel, gain, out));
  check_values(in, wide_kernel, out);

  // The gradient of sum(weights * out) with respect to both images.
  Buffer<float> d_in(width, height), d_kernel(3);
  check_code("tone_gradient", tone_gradient(in, kernel, gain, weights, d_in, d_kernel));
  for (int k = 0; k < 3; k++) check("d kernel", d_kernel(k), slope(in, kernel, weights, kernel(k)));
  for (int x : {0, 1, 17, 36}) {
    for (int y : {0, 5, 10}) check("d input", d_in(x, y), slope(in, kernel, weights, in(x, y)));
  }
  std::printf("values and gradients agree\n");
  return 0;
}

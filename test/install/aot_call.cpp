// A user's program that calls the functions compiled by aot_generate; it uses Halide's headers and
// no compiler.
#include <HalideBuffer.h>

#include <cmath>
#include <cstdio>

#include "curve.h"

int main() {
  Halide::Runtime::Buffer<float, 2> in(33, 9), out(33, 9);
  in.for_each_element([&](int x, int y) { in(x, y) = static_cast<float>(x + 33 * y) / 297.0f; });
  if (const int code = curve(in, 2.0f, out)) return code;
  float worst = 0.0f;
  in.for_each_element(
      [&](int x, int y) { worst = std::fmax(worst, std::fabs(out(x, y) - std::sqrt(in(x, y)))); });
  std::printf("largest error %g\n", static_cast<double>(worst));
  return worst <= 1e-6f ? 0 : 1;
}

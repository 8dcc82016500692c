// A program written for Halide; the include path decides which compiler it uses.
#include "Halide.h"

#include <algorithm>
#include <cstdio>

using Halide::Buffer;
using Halide::Expr;
using Halide::Func;
using Halide::RDom;
using Halide::Var;

int main() {
  Buffer<uint8_t> input(64, 48);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) input(x, y) = static_cast<uint8_t>(x * 7 + y * 13);
  }

  Var x("x"), y("y");
  Func clamped = Halide::BoundaryConditions::repeat_edge(input);
  Func wide("wide"), blur_x("blur_x"), blur_y("blur_y");
  wide(x, y) = Halide::cast<uint16_t>(clamped(x, y));
  blur_x(x, y) = wide(x - 1, y) + wide(x, y) + wide(x + 1, y);
  blur_y(x, y) = Halide::cast<uint8_t>((blur_x(x, y - 1) + blur_x(x, y) + blur_x(x, y + 1)) / 9);
  blur_x.compute_root().vectorize(x, 8);
  blur_y.vectorize(x, 8).parallel(y);
  Buffer<uint8_t> output = blur_y.realize({64, 48});

  auto at = [&](int px, int py) {
    return input(std::min(std::max(px, 0), 63), std::min(std::max(py, 0), 47));
  };
  for (int py = 0; py < 48; ++py) {
    for (int px = 0; px < 64; ++px) {
      int sum = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) sum += at(px + dx, py + dy);
      }
      if (output(px, py) != sum / 9) {
        std::printf("blur_y(%d, %d) = %d, by hand %d\n", px, py, output(px, py), sum / 9);
        return 1;
      }
    }
  }
  std::printf("3072 pixels agree\n");
  return 0;
}

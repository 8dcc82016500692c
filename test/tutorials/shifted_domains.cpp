// Regions that do not start at the origin.
#include "Halide.h"

#include <cstdio>

using namespace Halide;

int main() {
  Func distance("distance");
  Var x("x"), y("y");
  distance(x, y) = abs(x) + abs(y);

  // A Buffer has a min in each dimension; realize() computes the region that the Buffer covers.
  Buffer<uint32_t> around(7, 5);
  around.set_min(-3, -2);
  distance.realize(around);
  for (int j = around.top(); j <= around.bottom(); j++) {
    for (int i = around.left(); i <= around.right(); i++) printf("%3d", (int)around(i, j));
    printf("\n");
  }

  // Translating a Buffer renames its coordinates and moves no data.
  Buffer<uint32_t> elsewhere(4, 3);
  elsewhere.set_min(100, 50);
  distance.realize(elsewhere);
  printf("dim 0 is [%d, %d], at its corner %d\n", elsewhere.dim(0).min(), elsewhere.dim(0).max(),
         (int)elsewhere(100, 50));
  elsewhere.translate(0, -100);
  elsewhere.translate({0, -50});
  printf("moved: dim 0 is [%d, %d], at its corner %d\n", elsewhere.dim(0).min(),
         elsewhere.dim(0).max(), (int)elsewhere(0, 0));

  // An input can be read at any coordinate that it covers.
  Buffer<uint8_t> samples(10);
  samples.set_min(-4);
  for (int i = -4; i < 6; i++) samples(i) = (uint8_t)(i + 4);
  Func mirrored("mirrored");
  mirrored(x) = samples(-x);
  Buffer<uint8_t> window(9);
  window.set_min(-4);
  mirrored.realize(window);
  for (int i = -4; i < 5; i++) printf("%d ", window(i));
  printf("\n");

  // Bounds inference: the required region of an input follows from the region of the output.
  ImageParam input(UInt(8), 2, "input");
  Func shifted("shifted");
  shifted(x, y) = input(x - 2, y + 3) + input(x + 1, y);
  shifted.infer_input_bounds({10, 20});
  Buffer<uint8_t> needed = input.get();
  printf("needs [%d, %d] x [%d, %d]\n", needed.left(), needed.right(), needed.top(),
         needed.bottom());
  return 0;
}

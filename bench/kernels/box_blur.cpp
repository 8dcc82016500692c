// box_blur -- the mean of 5 x 5 pixels, in 16-bit integers: sums along rows, then along columns.
//
// Each strip of rows slides down: a row of sums is computed once and used by five rows of results.
#include "kernel.h"

namespace kernels {

Kernel box_blur(const Setup& setup) {
  const int width = setup.size(2048, 213), height = setup.size(1536, 97), planes = 3;
  ImageParam input(UInt(16), 3, "input");
  Var x("x"), y("y"), c("c"), yi("yi");

  Func clamped = BoundaryConditions::repeat_edge(input);
  Func row_sum("row_sum"), mean("mean");
  Expr sum_x = clamped(x - 2, y, c);
  for (int i = -1; i <= 2; i++) sum_x = sum_x + clamped(x + i, y, c);
  row_sum(x, y, c) = sum_x;
  Expr total = row_sum(x, y - 2, c);
  for (int i = -1; i <= 2; i++) total = total + row_sum(x, y + i, c);
  mean(x, y, c) = total / cast<uint16_t>(25);

  const int lanes = setup.lanes<uint16_t>();
  if (setup.by_hand()) {
    mean.split(y, y, yi, 64).parallel(y).parallel(c).vectorize(x, lanes);
    row_sum.store_at(mean, y).compute_at(mean, yi).vectorize(x, lanes);
  }

  Buffer<uint16_t> image = make_image<uint16_t>({width, height, planes}, 2600);
  bind(input, image);
  Buffer<uint16_t> result(width, height, planes);
  return {Pipeline(mean), {image}, {result}, 9.0 * width * height * planes};
}

}  // namespace kernels

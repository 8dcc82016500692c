// non_local_means -- denoising by Buades, Coll and Morel (2005): each pixel becomes the mean of the
// pixels in a window of 7 x 7, weighted by how much the 5 x 5 patches around the two are alike.
//
// In tiles: for each offset of the window, the weights of the whole tile are made and used.
#include "kernel.h"

namespace kernels {

using namespace Halide;

Kernel non_local_means(const Setup& setup) {
  const int width = setup.size(960, 137), height = setup.size(640, 75);
  const int window = 3, patch = 2;
  const float strength = 8.0f;
  ImageParam input(Float(32), 3, "input");
  Var x("x"), y("y"), c("c"), dx("dx"), dy("dy"), xi("xi"), yi("yi");

  Func clamped = BoundaryConditions::repeat_edge(input);
  Func difference("difference"), column("column"), weight("weight"), sum("sum"), result("result");
  Expr squares = 0.0f;
  for (int i = 0; i < 3; i++) {
    Expr d = clamped(x, y, i) - clamped(x + dx, y + dy, i);
    squares = squares + d * d;
  }
  difference(x, y, dx, dy) = squares;
  Expr column_sum = 0.0f, patch_sum = 0.0f;
  for (int i = -patch; i <= patch; i++) column_sum = column_sum + difference(x, y + i, dx, dy);
  column(x, y, dx, dy) = column_sum;
  for (int i = -patch; i <= patch; i++) patch_sum = patch_sum + column(x + i, y, dx, dy);
  weight(x, y, dx, dy) = fast_exp(-strength * patch_sum);

  RDom r(-window, 2 * window + 1, -window, 2 * window + 1);
  sum(x, y, c) = 0.0f;
  sum(x, y, c) +=
      weight(x, y, r.x, r.y) * select(c < 3, clamped(x + r.x, y + r.y, min(c, 2)), 1.0f);
  result(x, y, c) = sum(x, y, c) / sum(x, y, 3);

  const int lanes = setup.lanes<float>();
  result.bound(c, 0, 3).tile(x, y, xi, yi, 128, 32).reorder(xi, c, yi, x, y);
  result.parallel(y).vectorize(xi, lanes);
  sum.compute_at(result, x).bound(c, 0, 4).vectorize(x, lanes);
  sum.update().reorder(c, x, y, r.x, r.y).unroll(c).vectorize(x, lanes);
  weight.compute_at(sum, r.x).vectorize(x, lanes);
  column.compute_at(sum, r.x).vectorize(x, lanes);
  difference.compute_at(sum, r.x).vectorize(x, lanes);

  Buffer<float> image = make_image<float>({width, height, 3});
  input.set(image);
  Buffer<float> output(width, height, 3);
  return {Pipeline(result), {image}, {output}, 49 * (9 + 8 + 10 + 8.0) * width * height};
}

}  // namespace kernels

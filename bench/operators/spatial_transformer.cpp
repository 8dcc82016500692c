// spatial_transformer -- applies affine transforms to images, with zeros outside. Gradients: images and transforms.
// Source: Jaderberg et al., Spatial Transformer Networks, NeurIPS 2015.
#include "operator.h"

namespace kernels {

namespace {

Buffer<real> make_transforms(int images) {
  Buffer<real> transforms(3, 2, images);
  for (int n = 0; n < images; n++) {
    const float angle = 0.1f + 0.35f * n, scale = 0.9f + 0.07f * n;
    const float rows[2][3] = {
        {scale * std::cos(angle), -scale * std::sin(angle), 0.013f + 0.05f * n},
        {scale * std::sin(angle), scale * std::cos(angle), 0.007f - 0.03f * n}};
    for (int row = 0; row < 2; row++) {
      for (int column = 0; column < 3; column++) transforms(column, row, n) = rows[row][column];
    }
  }
  return transforms;
}

}  // namespace

Kernel spatial_transformer(const Setup& setup) {
  const int width = setup.size(512, 25), height = setup.size(512, 19);
  const int channels = setup.size(16, 3), images = setup.size(4, 2);
  const Buffer<real> input = make_waves({width, height, channels, images}, -1, 1, 23);
  const Buffer<real> theta = make_transforms(images);
  Var x("x"), y("y"), c("c"), n("n");
  Expr across = (2 * x + 1) * (1.0f / width) - 1, down = (2 * y + 1) * (1.0f / height) - 1;
  auto place = [&](int row, int size) -> Expr {  // pixels from -1/2 to size - 1/2 are -1 to 1
    Expr at = theta(0, row, n) * across + theta(1, row, n) * down + theta(2, row, n);
    return ((at + 1.0f) * size - 1.0f) * 0.5f;
  };
  Func u("u"), v("v"), transformed("transformed");
  u(x, y, n) = place(0, width);
  v(x, y, n) = place(1, height);
  Func padded = BoundaryConditions::constant_exterior(input, real(0), {{0, width}, {0, height}});
  Expr i = clamp(cast<int>(floor(u(x, y, n))), -2, width);
  Expr j = clamp(cast<int>(floor(v(x, y, n))), -2, height);
  Expr wx = u(x, y, n) - floor(u(x, y, n)), wy = v(x, y, n) - floor(v(x, y, n));
  transformed(x, y, c, n) = lerp(lerp(padded(i, j, c, n), padded(i + 1, j, c, n), wx),
                                 lerp(padded(i, j + 1, c, n), padded(i + 1, j + 1, c, n), wx), wy);
  const double elements = static_cast<double>(width) * height * channels * images;
  return gradients_of(setup, transformed, {width, height, channels, images}, {input, theta},
                      30 * elements);
}

}  // namespace kernels

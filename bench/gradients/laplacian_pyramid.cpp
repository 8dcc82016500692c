// laplacian_pyramid -- splits an image into 4 levels, applies a gain to each, and recombines them. Gradients: image and
// gains.
#include "gradient.h"

namespace kernels {

namespace {

Var x("x"), y("y");

Func smaller(const Func& image) {
  Func rows, both;
  rows(x, y) = (image(2 * x - 1, y) + 2.0f * image(2 * x, y) + image(2 * x + 1, y)) * 0.25f;
  both(x, y) = (rows(x, 2 * y - 1) + 2.0f * rows(x, 2 * y) + rows(x, 2 * y + 1)) * 0.25f;
  return both;
}

Func larger(const Func& image) {
  Func rows, both;
  rows(x, y) = (image(x / 2, y) + image((x + 1) / 2, y)) * 0.5f;
  both(x, y) = (rows(x, y / 2) + rows(x, (y + 1) / 2)) * 0.5f;
  return both;
}

}  // namespace

Kernel laplacian_pyramid(const Setup& setup) {
  const int width = setup.size(512, 128), height = setup.size(384, 96), levels = 4;
  const Buffer<float> image = make_values({width, height}, 0, 1);
  const Buffer<float> gain = make_values({levels}, 0.5f, 2.0f);
  std::vector<Func> gaussian{BoundaryConditions::repeat_edge(image)};
  for (int l = 1; l < levels; l++) gaussian.push_back(smaller(gaussian.back()));
  Func result("coarsest");
  result(x, y) = gaussian[levels - 1](x, y) * gain(Expr(levels - 1));
  for (int l = levels - 2; l >= 0; l--) {
    const Func base = larger(gaussian[l + 1]), rest = larger(result);
    Func sum;
    sum(x, y) = rest(x, y) + (gaussian[l](x, y) - base(x, y)) * gain(Expr(l));
    result = sum;
  }
  return gradients_of(setup, result, {width, height}, {image, gain}, 60.0 * width * height);
}

}  // namespace kernels

// deconvolution -- an image convolved with a 7 x 7 blur kernel. Gradients: both.
#include "gradient.h"

namespace kernels {

Kernel deconvolution(const Setup& setup) {
  const int width = setup.size(512, 25), height = setup.size(384, 19), side = 7;
  const Buffer<float> image = make_values({width, height}, 0, 1);
  const Buffer<float> kernel = make_values({side, side}, 0, 0.05f);
  Var x("x"), y("y");
  Func bounded = BoundaryConditions::repeat_edge(image);
  Func blurred("blurred");
  RDom r(0, side, 0, side);
  blurred(x, y) = 0.0f;
  blurred(x, y) += bounded(x + r.x - side / 2, y + r.y - side / 2) * kernel(r.x, r.y);
  return gradients_of(setup, blurred, {width, height}, {image, kernel},
                      2 * 2.0 * side * side * width * height);
}

}  // namespace kernels

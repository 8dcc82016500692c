// conv2d -- 3 x 3, 16 channels in and out, zero padding, bias. Gradients: input, weights and bias.
#include "../gradients/gradient.h"

namespace kernels {

Kernel conv2d(const Setup& setup) {
  const int width = setup.size(256, 13), height = setup.size(256, 11);
  const int channels = setup.size(16, 3), images = setup.size(4, 2);
  const Buffer<real> input = make_noise({width, height, channels, images}, 1);
  const Buffer<real> weights = make_values({3, 3, channels, channels}, -0.2f, 0.2f);
  const Buffer<real> bias = make_values({channels}, -1, 1);
  Var x("x"), y("y"), c("c"), n("n");
  Func padded = BoundaryConditions::constant_exterior(input, real(0));
  Func convolved("convolved");
  RDom r(0, 3, 0, 3, 0, channels);
  convolved(x, y, c, n) = bias(c);
  convolved(x, y, c, n) += weights(r.x, r.y, r.z, c) * padded(x + r.x - 1, y + r.y - 1, r.z, n);
  const double products = 9.0 * channels * channels * width * height * images;
  return gradients_of(setup, convolved, {width, height, channels, images}, {input, weights, bias},
                      3 * 2 * products);
}

}  // namespace kernels

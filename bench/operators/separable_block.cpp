// separable_block -- a depthwise 3 x 3 convolution, then a pointwise one, each with bias and ReLU. Gradients: input,
// both weights and both biases. Source: Howard et al., MobileNets, arXiv:1704.04861, section 3.1 (without
// normalisation).
#include "operator.h"

namespace kernels {

Kernel separable_block(const Setup& setup) {
  const int width = setup.size(128, 13), height = setup.size(128, 11);
  const int channels = setup.size(64, 5), images = setup.size(8, 2);
  const Buffer<real> input = make_noise({width, height, channels, images}, 1);
  const Buffer<real> depthwise = make_noise({3, 3, channels}, 2);
  const Buffer<real> depthwise_bias = make_values({channels}, -0.5f, 1);
  const Buffer<real> pointwise = make_noise({channels, channels}, 3);
  const Buffer<real> pointwise_bias = make_values({channels}, -0.5f, 1);
  Var x("x"), y("y"), c("c"), n("n");
  RDom k(0, 3, 0, 3), from(0, channels);
  Func padded = BoundaryConditions::constant_exterior(input, real(0));
  Func spread("spread"), inner("inner"), mixed("mixed"), block("block");
  spread(x, y, c, n) = depthwise_bias(c);
  spread(x, y, c, n) += depthwise(k.x, k.y, c) * padded(x + k.x - 1, y + k.y - 1, c, n);
  inner(x, y, c, n) = max(spread(x, y, c, n), 0.0f);
  mixed(x, y, c, n) = pointwise_bias(c);
  mixed(x, y, c, n) += pointwise(from, c) * inner(x, y, from, n);
  block(x, y, c, n) = max(mixed(x, y, c, n), 0.0f);
  const double products = (9.0 + channels) * channels * width * height * images;
  return gradients_of(setup, block, {width, height, channels, images},
                      {input, depthwise, depthwise_bias, pointwise, pointwise_bias},
                      3 * 2 * products);
}

}  // namespace kernels

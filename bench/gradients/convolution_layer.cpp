// convolution_layer -- 3 x 3, 16 channels in and out, bias, ReLU. Gradients: input, weights and bias.
#include "gradient.h"

namespace kernels {

Kernel convolution_layer(const Setup& setup) {
  const int width = setup.size(128, 13), height = setup.size(128, 11);
  const int channels = setup.size(16, 3);
  const Buffer<float> input = make_values({width + 2, height + 2, channels}, -1, 1);
  const Buffer<float> weights = make_values({3, 3, channels, channels}, -0.1f, 0.1f);
  const Buffer<float> bias = make_values({channels}, -0.1f, 0.1f);
  Var x("x"), y("y"), c("c");
  Func layer("layer"), relu("relu");
  RDom r(0, 3, 0, 3, 0, channels);
  layer(x, y, c) = bias(c);
  layer(x, y, c) += weights(r.x, r.y, r.z, c) * input(x + r.x, y + r.y, r.z);
  relu(x, y, c) = max(layer(x, y, c), 0.0f);
  // Counts the layer once more, for the sign, and two sums with as many products.
  const double products = 9.0 * channels * channels * width * height;
  return gradients_of(setup, relu, {width, height, channels}, {input, weights, bias},
                      3 * 2 * products);
}

}  // namespace kernels

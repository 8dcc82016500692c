// normalisation -- normalises each channel to mean 0 and variance 1, then scales and shifts it. Gradients: all inputs.
// Source: Wu and He, Group Normalization, ECCV 2018, equations 1 to 4.
#include "gradient.h"

namespace kernels {

Kernel normalisation(const Setup& setup) {
  const int width = setup.size(256, 21), height = setup.size(192, 13);
  const int channels = setup.size(16, 3);
  const Buffer<float> input = make_values({width, height, channels}, -1, 2);
  const Buffer<float> scale = make_values({channels}, 0.5f, 1.5f);
  const Buffer<float> shift = make_values({channels}, -0.5f, 0.5f);
  const float share = 1.0f / static_cast<float>(width * height);
  Var x("x"), y("y"), c("c");
  RDom r(0, width, 0, height);
  Func mean("mean"), variance("variance"), normal("normal");
  mean(c) = 0.0f;
  mean(c) += input(r.x, r.y, c) * share;
  variance(c) = 0.0f;
  variance(c) += pow(input(r.x, r.y, c) - mean(c), 2) * share;
  normal(x, y, c) = (input(x, y, c) - mean(c)) / sqrt(variance(c) + 1e-5f) * scale(c) + shift(c);
  return gradients_of(setup, normal, {width, height, channels}, {input, scale, shift},
                      16.0 * width * height * channels);
}

}  // namespace kernels

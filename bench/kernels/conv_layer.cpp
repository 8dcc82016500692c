// conv_layer -- a convolutional layer: 3 x 3, 32 channels in, 32 out, bias, ReLU, a batch of 4.
//
// Channels lie innermost. All output channels of 8 pixels in a row stay in registers over the whole
// reduction.
#include "kernel.h"

namespace kernels {

using namespace Halide;

Kernel conv_layer(const Setup& setup) {
  const int width = setup.size(128, 21), height = setup.size(96, 11), batch = setup.size(4, 2);
  const int channels = 32;
  ImageParam input(Float(32), 4, "input"), filter(Float(32), 4, "filter");
  ImageParam bias(Float(32), 1, "bias");
  Var co("co"), x("x"), y("y"), n("n"), xi("xi"), cv("cv");

  Func conv("conv"), relu("relu");
  RDom r(0, channels, 0, 3, 0, 3);
  conv(co, x, y, n) = bias(co);
  conv(co, x, y, n) += filter(co, r.x, r.y, r.z) * input(r.x, x + r.y, y + r.z, n);
  relu(co, x, y, n) = max(conv(co, x, y, n), 0.0f);

  const int lanes = setup.lanes<float>(), pixels = 8;
  relu.bound(co, 0, channels).split(x, x, xi, pixels).split(co, co, cv, lanes);
  relu.reorder(cv, co, xi, x, y, n).vectorize(cv).unroll(co).unroll(xi).parallel(y).parallel(n);
  conv.compute_at(relu, x).bound(co, 0, channels);
  conv.split(co, co, cv, lanes).vectorize(cv).unroll(co).unroll(x);
  conv.update().split(co, co, cv, lanes).reorder(cv, co, x, y, n, r.x, r.y, r.z);
  conv.update().vectorize(cv).unroll(co).unroll(x);

  Buffer<float> image = make_image<float>({channels, width + 2, height + 2, batch});
  Buffer<float> weights = make_image<float>({channels, channels, 3, 3});
  weights.for_each_value([](float& w) { w = (w - 0.5f) * 0.2f; });
  Buffer<float> offsets = make_image<float>({channels});
  input.set(image);
  filter.set(weights);
  bias.set(offsets);
  Buffer<float> output(channels, width, height, batch);
  return {Pipeline(relu),
          {image, weights, offsets},
          {output},
          2.0 * 9 * channels * channels * width * height * batch};
}

}  // namespace kernels

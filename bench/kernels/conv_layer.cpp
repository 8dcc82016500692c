// conv_layer -- a layer of a convolutional network: 3 x 3 taps, zero padding, 32 features in and 32 out, a bias for
// each, ReLU; a batch of 4.
//
// Features are innermost. A task computes one row of one picture; all features of 8 adjacent pixels stay in registers
// for the whole sum.
#include "kernel.h"

namespace kernels {

Kernel conv_layer(const Setup& setup) {
  const int width = setup.size(128, 21), height = setup.size(96, 11), batch = setup.size(4, 2);
  const int features = 32, reach = 1, taps = 2 * reach + 1;
  ImageParam pictures(Float(32), 4, "pictures"), kernel(Float(32), 4, "kernel");
  ImageParam offset(Float(32), 1, "offset");
  Var out("out"), x("x"), y("y"), which("which"), pixel("pixel"), lane("lane");

  Func sums("sums"), layer("layer");
  RDom tap(0, features, -reach, taps, -reach, taps, "tap");
  RVar in = tap.x, dx = tap.y, dy = tap.z;
  sums(out, x, y, which) += pictures(in, x + dx, y + dy, which) * kernel(out, in, dx, dy);
  layer(out, x, y, which) = max(sums(out, x, y, which) + offset(out), 0.0f);

  const int lanes = setup.lanes<float>(), pixels = 8;
  if (setup.by_hand()) {
    layer.bound(out, 0, features).split(x, x, pixel, pixels);
    layer.reorder(out, pixel, x, y, which).vectorize(out, lanes).unroll(out).unroll(pixel);
    layer.fuse(y, which, y).parallel(y);
    sums.compute_at(layer, x)
        .bound_extent(out, features)
        .vectorize(out, lanes)
        .unroll(out)
        .unroll(x);
    sums.update().split(out, out, lane, lanes).vectorize(lane);
    sums.update().reorder(lane, out, x, in, dx, dy, y, which).unroll(out).unroll(x);
  }

  // The picture is surrounded by zeros.
  Buffer<float> image = make_image<float>({features, width + 2, height + 2, batch});
  image.for_each_element([&](int f, int i, int j, int n) {
    if (i == 0 || j == 0 || i == width + 1 || j == height + 1) image(f, i, j, n) = 0.0f;
  });
  image.set_min(std::vector<int>{0, -reach, -reach, 0});
  Buffer<float> weights(features, features, taps, taps);
  // Weights of both signs, so that ReLU clamps about half of the sums.
  for (uint32_t i = 0; i < weights.number_of_elements(); i++)
    weights.data()[i] = (static_cast<float>(scrambled(i) & 1023) / 1023 - 0.5f) * 0.2f;
  weights.set_min(std::vector<int>{0, 0, -reach, -reach});
  Buffer<float> offsets = make_image<float>({features});
  bind(pictures, image);
  bind(kernel, weights);
  bind(offset, offsets);
  Buffer<float> output(features, width, height, batch);
  return {Pipeline(layer),
          {image, weights, offsets},
          {output},
          2.0 * taps * taps * features * features * width * height * batch};
}

}  // namespace kernels

// warp -- reads an image between pixels, at positions given by a flow. Gradients: image and flow.
#include "gradient.h"

namespace kernels {

Kernel warp(const Setup& setup) {
  const int width = setup.size(512, 25), height = setup.size(384, 19);
  const Buffer<float> image = make_values({width, height}, 0, 1);
  const Buffer<float> flow = make_values({width, height, 2}, -6, 6);
  Var x("x"), y("y");
  Expr u = clamp(cast<float>(x) + flow(x, y, 0), 0.0f, static_cast<float>(width) - 1.01f);
  Expr v = clamp(cast<float>(y) + flow(x, y, 1), 0.0f, static_cast<float>(height) - 1.01f);
  Expr i = clamp(cast<int>(floor(u)), 0, width - 2), j = clamp(cast<int>(floor(v)), 0, height - 2);
  Expr wu = u - floor(u), wv = v - floor(v);
  Func warped("warped");
  warped(x, y) = lerp(lerp(image(i, j), image(i + 1, j), wu),
                      lerp(image(i, j + 1), image(i + 1, j + 1), wu), wv);
  return gradients_of(setup, warped, {width, height}, {image, flow}, 40.0 * width * height);
}

}  // namespace kernels

// flow_warp -- reads 64 channels between pixels, at positions given by a flow. Gradients: channels and flow.
#include "operator.h"

namespace kernels {

Kernel flow_warp(const Setup& setup) {
  const int width = setup.size(512, 25), height = setup.size(512, 19);
  const int channels = setup.size(64, 3);
  const Buffer<real> image = make_waves({width, height, channels}, -1, 1, 23);
  const Buffer<real> flow = off_grid(make_waves({width, height, 2}, -9, 9, 97), 64);
  Var x("x"), y("y"), c("c");
  Func u("u"), v("v"), warped("warped");
  u(x, y) = clamp(x + flow(x, y, 0), 0.0f, width - 1.0f);
  v(x, y) = clamp(y + flow(x, y, 1), 0.0f, height - 1.0f);
  warped(x, y, c) = bilinear(image, u(x, y), v(x, y), width, height, {c});
  const double pixels = static_cast<double>(width) * height;
  return gradients_of(setup, warped, {width, height, channels}, {image, flow},
                      30 * pixels * channels);
}

}  // namespace kernels

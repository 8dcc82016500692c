// gamma_mse -- the mean squared error of an image after gamma correction. Gradients: image and exponent.
#include "../gradients/gradient.h"

namespace kernels {

Kernel gamma_mse(const Setup& setup) {
  const int width = setup.size(2560, 27), height = setup.size(1600, 22), channels = 3;
  const Buffer<real> image = make_values({width, height, channels}, 0.05f, 1);
  const Buffer<real> target = make_values({width, height, channels}, 0, 1.5f);
  Buffer<real> gamma(std::vector<int>{1});
  gamma.fill(0.7f);
  Var x("x"), y("y"), c("c");
  Func corrected("corrected"), loss("loss");
  corrected(x, y, c) = pow(image(x, y, c), gamma(Expr(0)));
  RDom r(0, width, 0, height, 0, channels);
  Expr error = corrected(r.x, r.y, r.z) - target(r.x, r.y, r.z);
  const double elements = static_cast<double>(width) * height * channels;
  loss() = real(0);
  loss() += error * error * static_cast<float>(1 / elements);
  return gradients_of(setup, loss, {}, {image, gamma}, 10 * elements, {target});
}

}  // namespace kernels

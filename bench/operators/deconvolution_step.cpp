// deconvolution_step -- the objective of a deconvolution: how well a sharp image explains a blurred one, plus a prior
// of five weighted filters. Gradients: image, blur, weights and filters. Source: the problem of Li et al.,
// Differentiable Programming for Image Processing and Deep Learning in Halide, SIGGRAPH 2018, section 6.
#include "operator.h"

namespace kernels {

Kernel deconvolution_step(const Setup& setup) {
  const int width = setup.size(1024, 37), height = setup.size(1024, 29), side = 11, filters = 5;
  const Buffer<real> image = make_values({width, height}, 0, 1);
  const Buffer<real> blurred = make_waves({width, height}, 0, 1, 47);
  const Buffer<real> kernel = make_values({side, side}, 0, 2.0f / (side * side));
  const Buffer<real> weights = make_values({filters}, 0.02f, 0.1f);
  const Buffer<real> bank = make_noise({3, 3, filters}, 1);
  Var x("x"), y("y"), c("c");
  RDom k(0, side, 0, side), f(0, 3, 0, 3), r(0, width, 0, height), each(0, filters);
  Func padded = BoundaryConditions::constant_exterior(image, real(0));
  Func explained("explained"), filtered("filtered"), data("data"), prior("prior"), loss("loss");
  explained(x, y) = real(0);
  explained(x, y) += kernel(k.x, k.y) * padded(x + k.x - side / 2, y + k.y - side / 2);
  filtered(x, y, c) = real(0);
  filtered(x, y, c) += bank(f.x, f.y, c) * padded(x + f.x - 1, y + f.y - 1);
  data() = real(0);
  data() += pow(explained(r.x, r.y) - blurred(r.x, r.y), 2);
  prior(c) = real(0);
  prior(c) += pow(filtered(r.x, r.y, c), 2);
  loss() = data();
  loss() += weights(each) * prior(each);
  const double products = (side * side + 9.0 * filters) * width * height;
  return gradients_of(setup, loss, {}, {image, kernel, weights, bank}, 3 * 2 * products, {blurred});
}

}  // namespace kernels

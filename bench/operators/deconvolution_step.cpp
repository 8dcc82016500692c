// deconvolution_step -- how far a sharp image is from explaining a blurred one, and from what images
// are like, by five weighted filters: by image, blur, weights and filters.
// Source: the problem of Li et al., Differentiable Programming for Image Processing and Deep Learning
// in Halide, SIGGRAPH 2018, section 6.
#include "operator.h"

namespace kernels {

using namespace Halide;

Kernel deconvolution_step(const Setup& setup) {
  const int width = setup.size(1024, 37), height = setup.size(1024, 29), side = 11, filters = 5;
  const Buffer<float> image = make_values({width, height}, 0, 1);
  const Buffer<float> blurred = make_waves({width, height}, 0, 1, 47);
  const Buffer<float> kernel = make_values({side, side}, 0, 2.0f / (side * side));
  const Buffer<float> weights = make_values({filters}, 0.02f, 0.1f);
  const Buffer<float> bank = make_noise({3, 3, filters}, 1);
  Var x("x"), y("y"), c("c");
  RDom k(0, side, 0, side), f(0, 3, 0, 3), r(0, width, 0, height), each(0, filters);
  Func padded = BoundaryConditions::constant_exterior(image, 0.0f);
  Func explained("explained"), filtered("filtered"), data("data"), prior("prior"), loss("loss");
  explained(x, y) = 0.0f;
  explained(x, y) += kernel(k.x, k.y) * padded(x + k.x - side / 2, y + k.y - side / 2);
  filtered(x, y, c) = 0.0f;
  filtered(x, y, c) += bank(f.x, f.y, c) * padded(x + f.x - 1, y + f.y - 1);
  data() = 0.0f;
  data() += pow(explained(r.x, r.y) - blurred(r.x, r.y), 2);
  prior(c) = 0.0f;
  prior(c) += pow(filtered(r.x, r.y, c), 2);
  loss() = data();
  loss() += weights(each) * prior(each);
  const double products = (side * side + 9.0 * filters) * width * height;
  return gradients_of(setup, loss, {}, {image, kernel, weights, bank}, 3 * 2 * products, {blurred});
}

}  // namespace kernels

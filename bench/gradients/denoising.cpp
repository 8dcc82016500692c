// denoising -- fidelity plus smoothed total variation of every pixel. Gradients: the image. Source: Rudin, Osher,
// Fatemi, Nonlinear total variation based noise removal, 1992.
#include "gradient.h"

namespace kernels {

Kernel denoising(const Setup& setup) {
  const int width = setup.size(1024, 27), height = setup.size(768, 22);
  const Buffer<float> image = make_values({width, height}, 0, 1);
  const Buffer<float> noisy = make_values({width, height}, 0, 1.1f);
  Var x("x"), y("y");
  Func bounded = BoundaryConditions::repeat_edge(image);
  Expr dx = bounded(x + 1, y) - bounded(x, y), dy = bounded(x, y + 1) - bounded(x, y);
  Func energy("energy");
  energy(x, y) = pow(image(x, y) - noisy(x, y), 2) + 0.1f * sqrt(dx * dx + dy * dy + 1e-4f);
  return gradients_of(setup, energy, {width, height}, {image}, 24.0 * width * height);
}

}  // namespace kernels

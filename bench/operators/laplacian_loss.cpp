// laplacian_loss -- the distance of an image from a target, in each band of a Laplacian pyramid. Gradients: the image.
// Source: the loss of Bojanowski et al., Optimizing the Latent Space of Generative Networks, ICML 2018, section 3, with
// sqrt(d^2 + 1e-4) for |d|.
#include "operator.h"

namespace kernels {

namespace {

constexpr int levels = 8;

// Half the size, by weights 1 3 3 1 along both dimensions, with repeated edges.
Func smaller(const Func& image, int width, int height) {
  Var x("x"), y("y");
  Func f = BoundaryConditions::repeat_edge(image, {{0, width}, {0, height}});
  Func across("across"), down("down");
  across(x, y) = (f(2 * x - 1, y) + 3 * (f(2 * x, y) + f(2 * x + 1, y)) + f(2 * x + 2, y)) / 8;
  down(x, y) = (across(x, 2 * y - 1) + 3 * (across(x, 2 * y) + across(x, 2 * y + 1)) +
                across(x, 2 * y + 2)) /
               8;
  return down;
}

// Twice the size, interpolated between the centres of pixels.
Func larger(const Func& image, int width, int height) {
  Var x("x"), y("y");
  Func f = BoundaryConditions::repeat_edge(image, {{0, width}, {0, height}});
  Func across("across"), down("down");
  across(x, y) = 0.75f * f(x / 2, y) + 0.25f * f(x / 2 - 1 + 2 * (x % 2), y);
  down(x, y) = 0.75f * across(x, y / 2) + 0.25f * across(x, y / 2 - 1 + 2 * (y % 2));
  return down;
}

}  // namespace

Kernel laplacian_loss(const Setup& setup) {
  const int side = setup.size(1024, 128);
  const Buffer<real> image = make_values({side, side}, 0, 1);
  const Buffer<real> target = make_waves({side, side}, 0, 1, 61);
  Var x("x"), y("y");
  Func rest("rest"), loss("loss");
  rest(x, y) = image(x, y) - target(x, y);
  loss() = real(0);
  for (int level = 0, size = side; level < levels; level++, size /= 2) {
    Func detail("detail"), next;
    if (level + 1 < levels) {
      next = smaller(rest, size, size);
      detail(x, y) = rest(x, y) - larger(next, size / 2, size / 2)(x, y);
    } else {
      detail(x, y) = rest(x, y);
    }
    RDom r(0, size, 0, size);
    const float weight = static_cast<float>(1 << level) / static_cast<float>(size * size);
    loss() += weight * sqrt(detail(r.x, r.y) * detail(r.x, r.y) + 1e-4f);
    rest = next;
  }
  return gradients_of(setup, loss, {}, {image}, 60.0 * side * side, {target});
}

}  // namespace kernels

// non_local_means -- each pixel is a mean over an 11 x 11 window, weighted by the similarity of the 7 x 7 patches
// around both pixels. Gradients: image and strength. Source: Buades, Coll and Morel, A Non-Local Algorithm for Image
// Denoising, CVPR 2005.
#include "operator.h"

namespace kernels {

Kernel non_local_means(const Setup& setup) {
  const int width = setup.size(1024, 25), height = setup.size(1024, 19);
  const int patch = 7, search = 11;
  const Buffer<real> image = make_values({width, height}, 0, 1);
  Buffer<real> strength(std::vector<int>{1});
  strength.fill(9.0f);
  Var x("x"), y("y"), dx("dx"), dy("dy");
  RDom p(-(patch / 2), patch), s(-(search / 2), search, -(search / 2), search);
  Func f = BoundaryConditions::repeat_edge(image);
  Func difference("difference"), across("across"), distance("distance"), weight("weight");
  Func weights("weights"), values("values"), denoised("denoised");
  difference(x, y, dx, dy) = pow(f(x, y) - f(x + dx, y + dy), 2);
  across(x, y, dx, dy) = real(0);
  across(x, y, dx, dy) += difference(x + p, y, dx, dy);
  distance(x, y, dx, dy) = real(0);
  distance(x, y, dx, dy) += across(x, y + p, dx, dy);
  weight(x, y, dx, dy) =
      exp(-strength(Expr(0)) * distance(x, y, dx, dy) * (1.0f / (patch * patch)));
  weights(x, y) = real(0);
  weights(x, y) += weight(x, y, s.x, s.y);
  values(x, y) = real(0);
  values(x, y) += weight(x, y, s.x, s.y) * f(x + s.x, y + s.y);
  denoised(x, y) = values(x, y) / weights(x, y);
  const double terms = static_cast<double>(search) * search * width * height;
  return gradients_of(setup, denoised, {width, height}, {image, strength}, 70 * terms);
}

}  // namespace kernels

// non_local_means -- denoising by Buades, Coll and Morel (2005), with the weights of their text of 2011 (IPOL,
// "Non-local means denoising", section 2): each pixel becomes the mean of the pixels in a 7 x 7 window, weighted by
// exp(-max(d - 2 sigma^2, 0) / h^2), where d is the mean squared difference of the 5 x 5 patches around the two.
//
// One offset of the window after another, over tiles that stay in the cache: distances of all pixels to their partners,
// their sums over patches, and the partners' contributions.
#include "kernel.h"

namespace kernels {

Kernel non_local_means(const Setup& setup) {
  const int width = setup.size(960, 137), height = setup.size(640, 75);
  const int reach = 3, patch_reach = 2;  // on either side
  const float sigma = 0.05f, h = 0.3f;
  ImageParam noisy(Float(32), 3, "noisy");
  Var x("x"), y("y"), c("c"), u("u"), v("v"), px("px"), py("py");
  Func extended = BoundaryConditions::repeat_edge(noisy);
  RDom offset(-reach, 2 * reach + 1, -reach, 2 * reach + 1, "offset");

  Func distance("distance"), in_row("in_row"), likeness("likeness");
  auto squared = [&](int channel) {
    Expr step = extended(x + u, y + v, channel) - extended(x, y, channel);
    return step * step;
  };
  distance(x, y, u, v) = squared(0) + squared(1) + squared(2);
  auto around = [&](const Func& f, bool is_across) -> Expr {
    Expr sum = f(x, y, u, v);
    for (int k = 1; k <= patch_reach; k++) {
      sum +=
          is_across ? f(x - k, y, u, v) + f(x + k, y, u, v) : f(x, y - k, u, v) + f(x, y + k, u, v);
    }
    return sum;
  };
  in_row(x, y, u, v) = around(distance, true);
  Expr of_patch = around(in_row, false);
  const int compared = 3 * (2 * patch_reach + 1) * (2 * patch_reach + 1);
  Expr beyond_noise = max(of_patch * (1.0f / compared) - 2 * sigma * sigma, 0.0f);
  likeness(x, y, u, v) = fast_exp(beyond_noise * (-1.0f / (h * h)));

  // The sums of red, green and blue over all partners, and of their weights.
  Func mean("mean"), denoised("denoised");
  Expr weight = likeness(x, y, offset.x, offset.y);
  auto partner = [&](int channel) { return extended(x + offset.x, y + offset.y, channel); };
  mean(x, y) = Tuple(0.0f, 0.0f, 0.0f, 0.0f);
  mean(x, y) = Tuple(mean(x, y)[0] + weight * partner(0), mean(x, y)[1] + weight * partner(1),
                     mean(x, y)[2] + weight * partner(2), mean(x, y)[3] + weight);
  denoised(x, y, c) = mux(c, {mean(x, y)[0], mean(x, y)[1], mean(x, y)[2]}) / mean(x, y)[3];

  const int lanes = setup.lanes<float>();
  if (setup.by_hand()) {
    denoised.bound(c, 0, 3).tile(x, y, px, py, 96, 16).reorder(c, px, py, x, y);
    denoised.unroll(c).vectorize(px, lanes).parallel(y);
    mean.compute_at(denoised, x).vectorize(x, lanes);
    mean.update().reorder(x, y, offset.x, offset.y).vectorize(x, lanes);
    for (Func f : {distance, in_row}) f.compute_at(mean, offset.x).vectorize(x, lanes);
  }

  Buffer<float> image = make_image<float>({width, height, 3});
  bind(noisy, image);
  Buffer<float> output(width, height, 3);
  return {Pipeline(denoised), {image}, {output}, 49 * (8 + 8 + 12 + 7.0) * width * height};
}

}  // namespace kernels

// unsharp_mask -- sharpens a colour image by the difference between its luminance and a Gaussian blur.
//
// In strips of rows: luminance and its blur along y are computed row by row, just before they are used.
#include <cmath>

#include "kernel.h"

namespace kernels {

Kernel unsharp_mask(const Setup& setup) {
  const int width = setup.size(1920, 187), height = setup.size(1280, 113);
  const int radius = 3;
  const float sigma = 1.5f, strength = 1.2f;
  ImageParam input(Float(32), 3, "input");
  Var x("x"), y("y"), c("c"), yi("yi");

  std::vector<float> weights;
  float total = 0;
  for (int i = -radius; i <= radius; i++) {
    weights.push_back(std::exp(-static_cast<float>(i * i) / (2 * sigma * sigma)));
    total += weights.back();
  }
  for (float& weight : weights) weight /= total;

  Func clamped = BoundaryConditions::repeat_edge(input);
  Func luminance("luminance"), blur_y("blur_y"), blurred("blurred"), gain("gain"), sharp("sharp");
  luminance(x, y) =
      0.299f * clamped(x, y, 0) + 0.587f * clamped(x, y, 1) + 0.114f * clamped(x, y, 2);
  Expr sum_y = 0.0f, sum_x = 0.0f;
  for (int i = -radius; i <= radius; i++) sum_y = sum_y + weights[i + radius] * luminance(x, y + i);
  blur_y(x, y) = sum_y;
  for (int i = -radius; i <= radius; i++) sum_x = sum_x + weights[i + radius] * blur_y(x + i, y);
  blurred(x, y) = sum_x;
  // Colours keep their proportions.
  gain(x, y) = 1.0f + strength * (luminance(x, y) - blurred(x, y)) / (luminance(x, y) + 0.01f);
  sharp(x, y, c) = clamp(gain(x, y) * input(x, y, c), 0.0f, 1.0f);

  const int lanes = setup.lanes<float>();
  if (setup.by_hand()) {
    sharp.bound(c, 0, 3).split(y, y, yi, 32).reorder(x, c, yi, y).parallel(y).vectorize(x, lanes);
    luminance.store_at(sharp, y).compute_at(sharp, yi).vectorize(x, lanes);
    blur_y.compute_at(sharp, yi).vectorize(x, lanes);
    gain.compute_at(sharp, yi).vectorize(x, lanes);
  }

  Buffer<float> image = make_image<float>({width, height, 3});
  bind(input, image);
  Buffer<float> result(width, height, 3);
  return {Pipeline(sharp), {image}, {result}, (5 + 14 + 14 + 6 + 9.0) * width * height};
}

}  // namespace kernels

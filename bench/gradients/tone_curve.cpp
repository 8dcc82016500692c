// tone_curve -- maps an image through a curve with 64 knots, linear in between. Gradients: curve and image.
#include "gradient.h"

namespace kernels {

Kernel tone_curve(const Setup& setup) {
  const int width = setup.size(1024, 27), height = setup.size(768, 22), knots = 64;
  const Buffer<float> image = make_values({width, height}, 0.001f, 0.998f);
  const Buffer<float> curve = make_values({knots + 1}, 0, 1);
  Var x("x"), y("y");
  Expr at = clamp(image(x, y), 0.0f, 0.999f) * static_cast<float>(knots);
  Expr i = clamp(cast<int>(floor(at)), 0, knots - 1), w = at - floor(at);
  Func toned("toned");
  toned(x, y) = lerp(curve(i), curve(i + 1), w);
  return gradients_of(setup, toned, {width, height}, {curve, image}, 10.0 * width * height);
}

}  // namespace kernels

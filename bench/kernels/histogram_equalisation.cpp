// histogram_equalisation -- equalises the brightness of an 8-bit colour picture: the running sum of the luminance
// histogram is the tone curve, and the change of luminance is added to each colour.
//
// Histograms of strips are counted in parallel, then added.
#include "kernel.h"

namespace kernels {

Kernel histogram_equalisation(const Setup& setup) {
  const int width = setup.size(2304, 223), height = setup.size(1536, 230), rows = 32;
  ImageParam input(UInt(8), 3, "input");
  Var x("x"), y("y"), c("c"), i("i"), s("s"), yi("yi");

  Func luminance("luminance"), histogram("histogram"), sum("sum");
  Func curve("curve"), result("result");
  auto wide = [&](int colour) { return cast<uint16_t>(input(x, y, colour)); };
  luminance(x, y) = cast<uint8_t>((77 * wide(0) + 150 * wide(1) + 29 * wide(2)) >> 8);
  RDom r(0, width, 0, height), up(1, 255);
  histogram(i) = cast<uint32_t>(0);
  histogram(cast<int>(luminance(r.x, r.y))) += cast<uint32_t>(1);
  sum(i) = histogram(i);
  sum(up) = sum(up - 1) + histogram(up);
  curve(i) = cast<int16_t>((sum(i) * 255) / cast<uint32_t>(width * height)) - cast<int16_t>(i);
  Expr change = curve(cast<int>(luminance(x, y)));
  result(x, y, c) = cast<uint8_t>(clamp(cast<int16_t>(input(x, y, c)) + change, 0, 255));

  const int lanes = setup.lanes<uint8_t>();
  if (setup.by_hand()) {
    luminance.compute_root().parallel(y, rows).vectorize(x, lanes);
    RVar ro("ro"), ri("ri");
    histogram.compute_root().vectorize(i, 16);
    Func partial = histogram.update().split(r.y, ro, ri, rows).rfactor(ro, s);
    partial.compute_root().vectorize(i, 16).update().parallel(s);
    histogram.update().reorder(i, ro).vectorize(i, 16);
    sum.compute_root();
    curve.compute_root().vectorize(i, 16);
    result.bound(c, 0, 3).split(y, y, yi, rows).reorder(c, x, yi, y).unroll(c);
    result.parallel(y).vectorize(x, 32);
  }

  Buffer<uint8_t> image = make_image<uint8_t>({width, height, 3}, 180);
  bind(input, image);
  Buffer<uint8_t> output(width, height, 3);
  return {Pipeline(result), {image}, {output}, (2 * 6 + 1 + 3.0) * width * height};
}

}  // namespace kernels

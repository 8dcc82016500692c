// iir_blur -- a wide blur by a first-order recursive filter, down and up all columns, then along all rows; the picture
// is transposed in between.
//
// A task filters a few vectors of columns from top to bottom and back, and stores them transposed.
#include "kernel.h"

namespace kernels {

namespace {

// Filters the columns of f, which has `height` rows; the result is transposed.
Func filter_columns(const Func& f, int height, float keep, const Setup& setup,
                    const std::string& name) {
  Var x("x"), y("y"), c("c"), xi("xi"), yo("yo"), yi("yi"), strip("strip");
  RDom down(1, height - 1), up(1, height - 1);
  const int lanes = setup.lanes<float>();
  Func column(name + "_column"), transposed(name + "_transposed");
  column(x, y, c) = f(x, y, c);
  column(x, down, c) = keep * column(x, down - 1, c) + (1 - keep) * f(x, down, c);
  Expr back = height - 1 - up;
  column(x, back, c) = keep * column(x, back + 1, c) + (1 - keep) * column(x, back, c);
  transposed(x, y, c) = column(y, x, c);

  if (setup.by_hand()) {
    transposed.compute_root().split(y, strip, yo, 2 * lanes).split(yo, yo, yi, 8);
    transposed.split(x, x, xi, lanes).reorder(xi, yi, x, yo, strip, c);
    transposed.vectorize(xi).unroll(yi).parallel(strip).parallel(c);
    column.compute_at(transposed, strip).reorder(x, y, c).vectorize(x, lanes);
    column.update(0).reorder(x, down).vectorize(x, lanes);
    column.update(1).reorder(x, up).vectorize(x, lanes);
  }
  return transposed;
}

}  // namespace

Kernel iir_blur(const Setup& setup) {
  const int width = setup.size(1536, 163), height = setup.size(1024, 107);
  ImageParam input(Float(32), 3, "input");
  const float keep = 0.9f;
  Func blurred = filter_columns(input, height, keep, setup, "vertical");
  Func result = filter_columns(blurred, width, keep, setup, "horizontal");

  Buffer<float> image = make_image<float>({width, height, 3});
  bind(input, image);
  Buffer<float> output(width, height, 3);
  return {Pipeline(result), {image}, {output}, 2 * 2 * 3.0 * width * height * 3};
}

}  // namespace kernels

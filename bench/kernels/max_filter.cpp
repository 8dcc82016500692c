// max_filter -- the maximum over a 31 x 31 window around each point, by doubling: maxima over 2, 4, 8 and 16 points, of
// which two of the last cover 31 (van Herk's idea, in a form that vectorizes).
//
// In strips of rows; the maxima along y keep the rows that are still needed.
#include "kernel.h"

namespace kernels {

Kernel max_filter(const Setup& setup) {
  const int width = setup.size(1920, 233), height = setup.size(1280, 127), planes = 3;
  const int radius = 15;
  ImageParam input(Float(32), 3, "input");
  Var x("x"), y("y"), c("c"), yi("yi");

  Func clamped = BoundaryConditions::repeat_edge(input);
  std::vector<Func> doubling_y, doubling_x;
  Func source = clamped;
  for (int reach = 1; reach <= 8; reach *= 2) {
    Func next("column_" + std::to_string(2 * reach));
    next(x, y, c) = max(source(x, y, c), source(x, y + reach, c));
    doubling_y.push_back(next);
    source = next;
  }
  Func column("column"), result("result");
  column(x, y, c) = max(source(x, y - radius, c), source(x, y, c));
  source = column;
  for (int reach = 1; reach <= 8; reach *= 2) {
    Func next("row_" + std::to_string(2 * reach));
    next(x, y, c) = max(source(x, y, c), source(x + reach, y, c));
    doubling_x.push_back(next);
    source = next;
  }
  result(x, y, c) = max(source(x - radius, y, c), source(x, y, c));

  const int lanes = setup.lanes<float>();
  if (setup.by_hand()) {
    result.split(y, y, yi, 64).parallel(y).parallel(c).vectorize(x, lanes);
    for (Func f : doubling_y) f.store_at(result, y).compute_at(result, yi).vectorize(x, lanes);
    column.compute_at(result, yi).vectorize(x, lanes);
    for (Func f : doubling_x) f.compute_at(result, yi).vectorize(x, lanes);
  }

  Buffer<float> image = make_image<float>({width, height, planes});
  bind(input, image);
  Buffer<float> output(width, height, planes);
  return {Pipeline(result), {image}, {output}, 10.0 * width * height * planes};
}

}  // namespace kernels

// recursive_filter -- a first-order filter along rows and then along columns. Gradients: the image.
#include "gradient.h"

namespace kernels {

Kernel recursive_filter(const Setup& setup) {
  const int width = setup.size(1024, 27), height = setup.size(768, 22);
  const Buffer<float> image = make_values({width, height}, 0, 1);
  Var x("x"), y("y");
  Func rows("rows"), columns("columns");
  RDom rx(1, width - 1), ry(1, height - 1);
  rows(x, y) = image(x, y);
  rows(rx, y) = 0.4f * rows(rx, y) + 0.6f * rows(rx - 1, y);
  columns(x, y) = rows(x, y);
  columns(x, ry) = 0.4f * columns(x, ry) + 0.6f * columns(x, ry - 1);
  return gradients_of(setup, columns, {width, height}, {image}, 6.0 * width * height);
}

}  // namespace kernels

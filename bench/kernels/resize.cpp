// resize -- enlarges a picture by 3/2 with three kernels: linear, cubic (Keys 1981) and Lanczos of radius 3. The three
// pictures are the outputs of one pipeline.
//
// Source positions are computed in integers. Rows are resized first, into the strip that needs them; then columns along
// the rows, where neighbours read overlapping sources.
#include "kernel.h"

namespace kernels {

namespace {

// Pixel p of the result is at position ((2p + 1) * 2 / 3 - 1) / 2 = (4p - 1) / 6 of the source.
Expr source_floor(const Expr& p) { return (4 * p - 1) / 6; }
Expr source_fraction(const Expr& p) { return cast<float>((4 * p - 1) % 6) * (1.0f / 6); }

Expr linear(const Expr& d) { return max(0.0f, 1.0f - abs(d)); }
Expr cubic(const Expr& d) {
  Expr a = abs(d);
  return select(a < 1.0f, (1.5f * a - 2.5f) * a * a + 1.0f,
                select(a < 2.0f, ((-0.5f * a + 2.5f) * a - 4.0f) * a + 2.0f, 0.0f));
}
Expr sinc(const Expr& d) {
  Expr angle = d * 3.14159265f;
  return select(abs(d) < 1e-4f, 1.0f, sin(angle) / angle);
}
Expr lanczos(const Expr& d) { return select(abs(d) < 3.0f, sinc(d) * sinc(d * (1.0f / 3)), 0.0f); }

struct Resized {
  Func weights, along_y, result;
};
Resized resized(const Func& source, Expr (*kernel)(const Expr&), int radius,
                const std::string& name) {
  Var x("x"), y("y"), k("k");
  Func raw(name + "_raw"), weights(name + "_weights"), along_y(name + "_y"), result(name);
  // weights(k, p): the weight of source pixel floor + k - radius + 1 for pixel p.
  raw(k, x) = kernel(cast<float>(k - radius + 1) - source_fraction(x));
  Expr total = 0.0f, sum_y = 0.0f, sum_x = 0.0f;
  for (int i = 0; i < 2 * radius; i++) total = total + raw(i, x);
  weights(k, x) = raw(k, x) / total;
  for (int i = 0; i < 2 * radius; i++)
    sum_y = sum_y + weights(i, y) * source(x, source_floor(y) + i - radius + 1);
  along_y(x, y) = sum_y;
  for (int i = 0; i < 2 * radius; i++)
    sum_x = sum_x + weights(i, x) * along_y(source_floor(x) + i - radius + 1, y);
  result(x, y) = sum_x;
  return {weights, along_y, result};
}

}  // namespace

Kernel resize(const Setup& setup) {
  const int width = setup.size(1920, 231), height = setup.size(1152, 96);
  ImageParam input(Float(32), 2, "input");
  Func clamped = BoundaryConditions::repeat_edge(input);
  Resized parts[] = {resized(clamped, linear, 1, "linear"), resized(clamped, cubic, 2, "cubic"),
                     resized(clamped, lanczos, 3, "lanczos")};

  const int lanes = setup.lanes<float>();
  Var x("x"), y("y"), k("k"), yi("yi");
  std::vector<Func> results;
  for (Resized& part : parts) {
    if (setup.by_hand()) {
      part.weights.compute_root().reorder_storage(x, k).reorder(x, k).vectorize(x, lanes);
      part.result.compute_root().split(y, y, yi, 32).parallel(y).vectorize(x, lanes);
      part.along_y.compute_at(part.result, yi).vectorize(x, lanes);
    }
    results.push_back(part.result);
  }

  Buffer<float> image = make_image<float>({width * 2 / 3, height * 2 / 3});
  bind(input, image);
  Buffer<float> out_linear(width, height), out_cubic(width, height), out_lanczos(width, height);
  return {Pipeline(results),
          {image},
          {out_linear, out_cubic, out_lanczos},
          2 * (2 + 4 + 6) * 5.0 / 3 * width * height};
}

}  // namespace kernels

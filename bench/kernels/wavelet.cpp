// wavelet -- denoising by the wavelets of Daubechies (1988) with 4 coefficients: 3 levels of the 2-D transform, small
// coefficients shrunk to zero, and the inverse transform.
//
// Each direction of each level is stored, computed in parallel strips. Only the transform along x is computed row by
// row, where the transform along y reads it.
#include "kernel.h"

namespace kernels {

namespace {

const float coefficient[] = {0.48296291f, 0.83651630f, 0.22414387f, -0.12940952f};

// Averages (b = 0) and details (b = 1), half as long, along x.
Func analyse_x(const Func& f, const std::string& name) {
  Var x("x"), y("y"), b("b");
  const float* h = coefficient;
  auto at = [&](int i) { return f(2 * x + i, y, _); };
  Func result(name);
  result(x, y, b, _) = mux(b, {h[0] * at(0) + h[1] * at(1) + h[2] * at(2) + h[3] * at(3),
                               h[3] * at(0) - h[2] * at(1) + h[1] * at(2) - h[0] * at(3)});
  return result;
}

}  // namespace

Kernel wavelet(const Setup& setup) {
  const int width = setup.size(2048, 192), height = setup.size(1536, 96);
  const int levels = 3;
  const float threshold = 0.08f;
  const float* h = coefficient;
  ImageParam input(Float(32), 2, "input");
  Var x("x"), y("y"), b("b"), yi("yi"), yii("yii"), xi("xi");
  const int lanes = setup.lanes<float>();

  // bands[j](x, y, b): averages; details along x; along y; along both.
  std::vector<Func> bands;
  Func source = BoundaryConditions::mirror_image(input);
  for (int j = 0; j < levels; j++) {
    const std::string number = std::to_string(j);
    Func rows = analyse_x(source, "rows_" + number);
    Func level("bands_" + number), averages("averages_" + number);
    auto at = [&](int i, int along_x) { return rows(x, 2 * y + i, along_x); };
    auto low = [&](int along_x) {
      return h[0] * at(0, along_x) + h[1] * at(1, along_x) + h[2] * at(2, along_x) +
             h[3] * at(3, along_x);
    };
    auto high = [&](int along_x) {
      return h[3] * at(0, along_x) - h[2] * at(1, along_x) + h[1] * at(2, along_x) -
             h[0] * at(3, along_x);
    };
    level(x, y, b) = mux(b, {low(0), low(1), high(0), high(1)});
    if (setup.by_hand()) {
      level.compute_root().bound(b, 0, 4).split(y, y, yi, 16).reorder(x, b, yi, y).unroll(b);
      level.parallel(y).vectorize(x, lanes);
      rows.store_at(level, y).compute_at(level, yi).bound(b, 0, 2).reorder(b, x, y).unroll(b);
      rows.vectorize(x, lanes);
    }
    averages(x, y) = level(x, y, 0);
    source = averages;
    bands.push_back(level);
  }

  Func better = source;  // the unchanged averages of the coarsest level
  for (int j = levels - 1; j >= 0; j--) {
    const std::string number = std::to_string(j);
    const Func& level = bands[j];
    const Func averages = better;
    auto band = [&](int which, const Expr& at_x, const Expr& at_y) -> Expr {
      if (which == 0) return averages(at_x, at_y);
      Expr v = level(at_x, at_y, which);
      return select(v > threshold, v - threshold, select(v < -threshold, v + threshold, 0.0f));
    };
    // Along y, then along x: even points, then odd ones.
    Func columns("columns_" + number), level_out("restored_" + number);
    auto inverse = [&](auto low, auto high, const Expr& p, const Expr& parity) {
      Expr even = h[2] * low(p - 1) + h[1] * high(p - 1) + h[0] * low(p) + h[3] * high(p);
      Expr odd = h[3] * low(p - 1) - h[0] * high(p - 1) + h[1] * low(p) - h[2] * high(p);
      return select(parity == 0, even, odd);
    };
    auto column = [&](int along_x) {
      return inverse([&](const Expr& p) { return band(along_x, x, p); },
                     [&](const Expr& p) { return band(2 + along_x, x, p); }, y / 2, y % 2);
    };
    columns(x, y, b) = mux(b, {column(0), column(1)});
    level_out(x, y) = inverse([&](const Expr& p) { return Expr(columns(p, y, 0)); },
                              [&](const Expr& p) { return Expr(columns(p, y, 1)); }, x / 2, x % 2);
    // Even and odd points side by side.
    if (setup.by_hand()) {
      level_out.compute_root().align_bounds(x, 2).align_bounds(y, 2);
      level_out.split(y, y, yi, 16).split(yi, yi, yii, 2).split(x, x, xi, 2);
      level_out.reorder(xi, x, yii, yi, y).unroll(xi).vectorize(x, lanes).parallel(y);
      columns.compute_at(level_out, yi).align_bounds(y, 2).bound(b, 0, 2).reorder(y, b, x);
      columns.unroll(y, 2).unroll(b).vectorize(x, lanes);
    }
    better = level_out;
  }

  Buffer<float> image = make_image<float>({width, height});
  bind(input, image);
  Buffer<float> output(width, height);
  return {Pipeline(better), {image}, {output}, 4.0 / 3 * (2 * 14 + 3) * width * height};
}

}  // namespace kernels

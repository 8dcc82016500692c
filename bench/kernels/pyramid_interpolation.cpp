// pyramid_interpolation -- fills the holes of a picture: pull and push (Gortler et al. 1996, "The Lumigraph", section
// 3.4), with the filters of Strengert, Kraus and Ertl (2006).
//
// A pixel is a colour and its trust, 0 to 1. Pull: each coarser pixel is the mean of four, weighted by their trust; the
// sum of their trust is clamped to 1. Push: from the coarsest level on, a pixel adds the coarser picture, weighted by 1
// minus its own trust.
//
// A level is one stored Func of four values, trust and colours times trust, computed in parallel strips of rows.
#include "kernel.h"

namespace kernels {

namespace {

// A pixel: three colours, each multiplied by the trust, and the trust.
struct Pixel {
  Expr red, green, blue, trust;
  Pixel(FuncRef f) : red(f[0]), green(f[1]), blue(f[2]), trust(f[3]) {}
  Pixel(Expr r, Expr g, Expr b, Expr t) : red(r), green(g), blue(b), trust(t) {}
  operator Tuple() const { return Tuple(red, green, blue, trust); }
  Pixel operator+(const Pixel& p) const {
    return {red + p.red, green + p.green, blue + p.blue, trust + p.trust};
  }
  Pixel operator*(Expr k) const { return {red * k, green * k, blue * k, trust * k}; }
};

// The sum of the four, scaled so that no trust exceeds 1.
Pixel pulled(const Func& fine, Var x, Var y) {
  const Pixel sum = Pixel(fine(2 * x, 2 * y)) + Pixel(fine(2 * x + 1, 2 * y)) +
                    Pixel(fine(2 * x, 2 * y + 1)) + Pixel(fine(2 * x + 1, 2 * y + 1));
  return sum * (1.0f / max(sum.trust, 1.0f));
}

// Centres of coarse pixels lie between those of fine ones. The nearer of the two centres next to a fine pixel counts
// three times as much (biquadratic B-splines).
Pixel mixed(const Pixel& nearer, const Pixel& farther) { return nearer * 0.75f + farther * 0.25f; }
Expr farther(Var x) { return x / 2 + 2 * (x % 2) - 1; }

}  // namespace

Kernel pyramid_interpolation(const Setup& setup) {
  const int width = setup.size(1536, 197), height = setup.size(1024, 141);
  const int levels = 9;
  ImageParam picture(Float(32), 3, "picture");  // red, green, blue, trust
  Var x("x"), y("y"), c("c"), row("row");
  const int lanes = setup.lanes<float>();
  auto made_in_strips = [&](Func& f, int rows) {
    if (setup.by_hand()) {
      f.compute_root().split(y, y, row, rows).parallel(y).vectorize(x, lanes);
    }
  };

  Func extended = BoundaryConditions::repeat_edge(picture), known[levels];
  for (int level = 0; level < levels; level++) {
    Func& f = known[level] = Func("known_" + std::to_string(level));
    const Expr trust = extended(x, y, 3);
    f(x, y) = level > 0
                  ? pulled(known[level - 1], x, y)
                  : Pixel(extended(x, y, 0), extended(x, y, 1), extended(x, y, 2), 1.0f) * trust;
    made_in_strips(f, level < 4 ? 16 : 4);
  }

  Func filled = known[levels - 1];
  for (int level = levels - 2; level >= 0; level--) {
    const std::string number = std::to_string(level);
    Func wide("wide_" + number), f("filled_" + number);
    wide(x, y) = mixed(filled(x / 2, y), filled(farther(x), y));
    const Pixel own = known[level](x, y), around = mixed(wide(x, y / 2), wide(x, farther(y)));
    f(x, y) = own + around * (1.0f - own.trust);
    made_in_strips(f, level < 4 ? 16 : 4);
    filled = f;
  }

  Func result("result");
  const Pixel last = filled(x, y);
  result(x, y, c) = mux(c, {last.red, last.green, last.blue}) / max(last.trust, 1e-6f);
  if (setup.by_hand()) {
    result.bound(c, 0, 3).reorder(c, x, y).unroll(c).vectorize(x, lanes);
    result.split(y, y, row, 32).parallel(y);
    filled.compute_at(result, row);
  }

  Buffer<float> image = make_image<float>({width, height, 4});
  // Holes of all sizes: a pixel's trust is 0 or 1.
  for (int j = 0; j < height; j++) {
    for (int i = 0; i < width; i++) image(i, j, 3) = image(i, j, 3) > 0.6f ? 1.0f : 0.0f;
  }
  bind(picture, image);
  Buffer<float> output(width, height, 3);
  // Per level: a quarter of a pull (18 operations), two mixtures and a blend (20).
  const double pixels = static_cast<double>(width) * height;
  return {Pipeline(result), {image}, {output}, (3 + 4.0 / 3 * (18 / 4.0 + 20 + 9) + 4) * pixels};
}

}  // namespace kernels

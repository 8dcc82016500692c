// local_laplacian -- the local contrast enhancement of Paris, Hasinoff and Kautz (2011) in the fast
// form of Aubry et al. (2014): Laplacian pyramids of 8 levels, of the picture remapped around each
// of 8 brightnesses, from which each coefficient of the result is interpolated.
//
// Every level of every pyramid is made once, in parallel strips; the Laplacians are made where they
// are read.
#include "kernel.h"

namespace kernels {

using namespace Halide;

namespace {

constexpr int levels = 8, brightnesses = 8;

// f(x, y, rest...)
FuncRef at(const Func& f, Expr x, Expr y, const std::vector<Var>& rest) {
  std::vector<Expr> args{x, y};
  args.insert(args.end(), rest.begin(), rest.end());
  return f(args);
}

struct Halved {
  Func along_x, result;
};
// Half the size, by the kernel (1 3 3 1) / 8 in both directions.
Halved halve(const Func& f, const std::vector<Var>& rest, const std::string& name) {
  Var x("x"), y("y");
  Halved h{Func(name + "_x"), Func(name)};
  auto source = [&](Expr px) -> Expr { return at(f, px, y, rest); };
  at(h.along_x, x, y, rest) =
      (source(2 * x - 1) + 3.0f * (source(2 * x) + source(2 * x + 1)) + source(2 * x + 2)) * 0.125f;
  auto row = [&](Expr py) -> Expr { return at(h.along_x, x, py, rest); };
  at(h.result, x, y, rest) =
      (row(2 * y - 1) + 3.0f * (row(2 * y) + row(2 * y + 1)) + row(2 * y + 2)) * 0.125f;
  return h;
}

// Twice the size, bilinear.
Func doubled(const Func& f, const std::vector<Var>& rest, const std::string& name) {
  Var x("x"), y("y");
  Func along_x(name + "_x"), result(name);
  at(along_x, x, y, rest) =
      0.25f * Expr(at(f, x / 2 - 1 + 2 * (x % 2), y, rest)) + 0.75f * Expr(at(f, x / 2, y, rest));
  at(result, x, y, rest) = 0.25f * Expr(at(along_x, x, y / 2 - 1 + 2 * (y % 2), rest)) +
                           0.75f * Expr(at(along_x, x, y / 2, rest));
  return result;
}

}  // namespace

Kernel local_laplacian(const Setup& setup) {
  const int width = setup.size(1536, 261), height = setup.size(1024, 153);
  const float sigma = 0.1f, gain = 0.7f;
  ImageParam input(Float(32), 3, "input");
  Var x("x"), y("y"), c("c"), k("k"), yi("yi");

  Func clamped = BoundaryConditions::repeat_edge(input);
  Func grey("grey");
  grey(x, y) = 0.299f * clamped(x, y, 0) + 0.587f * clamped(x, y, 1) + 0.114f * clamped(x, y, 2);

  // Around brightness k: details, which differ little from it, are enlarged.
  Func remapped("remapped");
  Expr difference = grey(x, y) - k * (1.0f / (brightnesses - 1));
  Expr in_sigmas = difference * (1.0f / sigma);
  remapped(x, y, k) = grey(x, y) + gain * difference / (1.0f + in_sigmas * in_sigmas);

  const int lanes = setup.lanes<float>();
  auto in_strips = [&](Func f, int rows) {
    f.compute_root().split(y, y, yi, rows).parallel(y).vectorize(x, lanes);
  };
  Func grey_pyramid[levels], pyramid[levels], enhanced[levels];
  grey_pyramid[0] = grey;
  pyramid[0] = remapped;
  grey.compute_root().split(y, y, yi, 32).parallel(y).vectorize(x, lanes);
  for (int j = 1; j < levels; j++) {
    Halved g = halve(grey_pyramid[j - 1], {}, "grey_" + std::to_string(j));
    Halved p = halve(pyramid[j - 1], {k}, "pyramid_" + std::to_string(j));
    grey_pyramid[j] = g.result;
    pyramid[j] = p.result;
    const int rows = j < 5 ? 8 : 4;
    in_strips(g.result, rows);
    p.result.compute_root().split(y, y, yi, rows).parallel(y).parallel(k).vectorize(x, lanes);
    p.along_x.store_at(p.result, y).compute_at(p.result, yi).vectorize(x, lanes);
  }

  for (int j = levels - 1; j >= 0; j--) {
    const std::string number = std::to_string(j);
    Func laplacian("laplacian_" + number), level("enhanced_" + number);
    laplacian(x, y, k) = pyramid[j](x, y, k);
    if (j + 1 < levels) {
      Func up = doubled(pyramid[j + 1], {k}, "pyramid_up_" + number);
      laplacian = Func("laplacian_of_" + number);
      laplacian(x, y, k) = pyramid[j](x, y, k) - up(x, y, k);
    }
    Expr brightness = clamp(grey_pyramid[j](x, y), 0.0f, 1.0f) * cast<float>(brightnesses - 1);
    Expr below = clamp(cast<int>(brightness), 0, brightnesses - 2);
    Expr fraction = brightness - below;
    Expr value = lerp(laplacian(x, y, below), laplacian(x, y, below + 1), fraction);
    if (j + 1 < levels) value = value + doubled(enhanced[j + 1], {}, "up_" + number)(x, y);
    level(x, y) = value;
    enhanced[j] = level;
    in_strips(level, j < 5 ? 8 : 4);
  }

  Func result("result");
  result(x, y, c) =
      clamp(input(x, y, c) * (enhanced[0](x, y) + 0.01f) / (grey(x, y) + 0.01f), 0.0f, 1.0f);
  result.bound(c, 0, 3).split(y, y, yi, 32).reorder(x, c, yi, y).parallel(y).vectorize(x, lanes);

  Buffer<float> image = make_image<float>({width, height, 3});
  input.set(image);
  Buffer<float> output(width, height, 3);
  // Levels add up to 4/3 of the first: remapping, halving and doubling for each brightness.
  return {Pipeline(result),
          {image},
          {output},
          (20 + 4.0 / 3 * (8 * (8 + 6) + 2 * 6 + 12)) * width * height};
}

}  // namespace kernels

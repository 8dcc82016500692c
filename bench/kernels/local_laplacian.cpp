// local_laplacian -- the local contrast enhancement of Paris, Hasinoff and Kautz (2011) in the fast form of Aubry et
// al. (2014): Laplacian pyramids with 8 levels of the picture remapped around each of 8 brightnesses, between which
// each coefficient of the result is interpolated.
//
// Every level of every pyramid is stored, computed in parallel strips; the Laplacians are computed where they are used.
#include "kernel.h"

namespace kernels {

namespace {

constexpr int levels = 8, brightnesses = 8;

// f(x, y, rest...)
FuncRef at(const Func& f, Expr x, Expr y, const std::vector<Var>& rest) {
  std::vector<Expr> args{x, y};
  args.insert(args.end(), rest.begin(), rest.end());
  return f(args);
}

struct Reduced {
  Func by_row, result;
};
// Half the size: each pixel is the mean of five in both directions, with weights 1 4 6 4 1 (Burt and Adelson 1983, "The
// Laplacian pyramid as a compact image code", a = 3/8).
Reduced reduced(const Func& f, const std::vector<Var>& rest, const std::string& name) {
  Var x("x"), y("y");
  Reduced half{Func(name + "_by_row"), Func(name)};
  auto weighted = [](auto pixel) {
    return pixel(0) * 0.375f + (pixel(-1) + pixel(1)) * 0.25f + (pixel(-2) + pixel(2)) * 0.0625f;
  };
  // Along columns first, while rows of the finer level are in the cache.
  at(half.by_row, x, y, rest) = weighted([&](int k) -> Expr { return at(f, x, 2 * y + k, rest); });
  at(half.result, x, y, rest) =
      weighted([&](int k) -> Expr { return at(half.by_row, 2 * x + k, y, rest); });
  return half;
}

// Twice the size: pixels of the coarser level, and the means of adjacent ones.
Func expanded(const Func& f, const std::vector<Var>& rest, const std::string& name) {
  Var x("x"), y("y");
  Func by_row(name + "_by_row"), result(name);
  at(by_row, x, y, rest) = (Expr(at(f, x, y / 2, rest)) + Expr(at(f, x, (y + 1) / 2, rest))) * 0.5f;
  at(result, x, y, rest) =
      (Expr(at(by_row, x / 2, y, rest)) + Expr(at(by_row, (x + 1) / 2, y, rest))) * 0.5f;
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

  // Remaps around brightness k: details, which differ little from it, are amplified.
  Func remapped("remapped");
  Expr difference = grey(x, y) - k * (1.0f / (brightnesses - 1));
  Expr in_sigmas = difference * (1.0f / sigma);
  remapped(x, y, k) = grey(x, y) + gain * difference / (1.0f + in_sigmas * in_sigmas);

  const int lanes = setup.lanes<float>();
  auto in_strips = [&](Func f, int rows) {
    if (!setup.by_hand()) return;
    f.compute_root().split(y, y, yi, rows).parallel(y).vectorize(x, lanes);
  };
  Func grey_pyramid[levels], pyramid[levels], enhanced[levels];
  grey_pyramid[0] = grey;
  pyramid[0] = remapped;
  in_strips(grey, 32);
  for (int j = 1; j < levels; j++) {
    Reduced g = reduced(grey_pyramid[j - 1], {}, "grey_" + std::to_string(j));
    Reduced p = reduced(pyramid[j - 1], {k}, "pyramid_" + std::to_string(j));
    grey_pyramid[j] = g.result;
    pyramid[j] = p.result;
    const int rows = j < 5 ? 8 : 4;
    in_strips(g.result, rows);
    in_strips(p.result, rows);
    if (!setup.by_hand()) continue;
    p.result.parallel(k);
    p.by_row.compute_at(p.result, yi).vectorize(x, lanes);
  }

  // A coefficient of the result interpolates between the two pictures remapped around the brightnesses next to the
  // pixel's own.
  const float just_below_last = brightnesses - 1 - 1e-4f;
  for (int j = levels - 1; j >= 0; j--) {
    const bool is_coarsest = j == levels - 1;
    const std::string number = std::to_string(j);
    Func detail("detail_" + number);
    Expr own = pyramid[j](x, y, k);
    detail(x, y, k) =
        is_coarsest ? own : own - expanded(pyramid[j + 1], {k}, "coarser_" + number)(x, y, k);
    Func level("enhanced_" + number);
    Expr place = clamp(grey_pyramid[j](x, y) * (brightnesses - 1.0f), 0.0f, just_below_last);
    Expr darker = cast<int>(place), share = place - darker;
    Expr mixture = (1.0f - share) * detail(x, y, darker) + share * detail(x, y, darker + 1);
    level(x, y) =
        is_coarsest ? mixture : mixture + expanded(enhanced[j + 1], {}, "up_" + number)(x, y);
    enhanced[j] = level;
    in_strips(level, j < 5 ? 8 : 4);
  }

  // Colours keep their differences from grey.
  Func result("result");
  result(x, y, c) = clamp(input(x, y, c) + enhanced[0](x, y) - grey(x, y), 0.0f, 1.0f);
  if (setup.by_hand()) {
    result.bound(c, 0, 3).split(y, y, yi, 32).reorder(x, c, yi, y).parallel(y).vectorize(x, lanes);
  }

  Buffer<float> image = make_image<float>({width, height, 3});
  bind(input, image);
  Buffer<float> output(width, height, 3);
  // The levels add up to 4/3 of the first: remapping, reducing and expanding for each brightness.
  return {Pipeline(result),
          {image},
          {output},
          (20 + 4.0 / 3 * (8 * (8 + 6) + 2 * 6 + 12)) * width * height};
}

}  // namespace kernels

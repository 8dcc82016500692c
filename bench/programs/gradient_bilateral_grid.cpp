// gradient_bilateral_grid -- splats a picture into a coarse grid by position and by a guide's brightness, blurs the
// grid, and reads it back by interpolation (Chen, Paris and Durand 2007). Gradients: picture and guide.
#include "gradient.h"

namespace {

struct GradientBilateralGrid : programs::GradientGenerator<GradientBilateralGrid> {
  Variable picture{"image", "picture", {512, 384}}, brightness{"guide", "brightness", {512, 384}};
  Seed seed{{512, 384}};

  void generate() {
    const int cell = 8, depth = 12;
    Func grid("grid"), blur_z("blur_z"), blur_x("blur_x"), blur_y("blur_y"), slice("slice");
    Var z("z");
    grid(x, y, z, c) = 0.0f;
    RDom corner(0, 512, 0, 384, 0, 2, 0, 2, "corner");
    Expr lev = brightness(corner.x, corner.y) * (depth - 1);
    Expr lo = clamp(cast<int>(lev), 0, depth - 2), part = lev - cast<float>(lo);
    Expr weight = select(corner.z == 0, 1.0f - part, part);
    grid(corner.x / cell, corner.y / cell, lo + corner.z, corner.w) +=
        weight * select(corner.w == 0, picture(corner.x, corner.y), 1.0f);
    auto blurred = [](auto at) { return 0.25f * at(-1) + 0.5f * at(0) + 0.25f * at(1); };
    const std::vector<int> cells = {64, 48, depth, 2};
    blur_z(x, y, z, c) = blurred([&](int d) {
      return programs::nearest(grid, cells, {x, y, z + d, c});
    });
    blur_x(x, y, z, c) = blurred([&](int d) {
      return programs::nearest(blur_z, cells, {x + d, y, z, c});
    });
    blur_y(x, y, z, c) = blurred([&](int d) {
      return programs::nearest(blur_x, cells, {x, y + d, z, c});
    });
    Expr fx = cast<float>(x % cell) / cell, fy = cast<float>(y % cell) / cell;
    Expr place = brightness(x, y) * (depth - 1), zi = clamp(cast<int>(place), 0, depth - 2);
    auto at = [&](int i, int j, int k) {
      return programs::nearest(blur_y, cells, {x / cell + i, y / cell + j, zi + k, c});
    };
    auto plane = [&](int k) {
      return lerp(lerp(at(0, 0, k), at(1, 0, k), fx), lerp(at(0, 1, k), at(1, 1, k), fx), fy);
    };
    slice(x, y, c) = lerp(plane(0), plane(1), place - cast<float>(zi));
    Func result("result");
    result(x, y) = slice(x, y, 0) / (slice(x, y, 1) + 0.01f);
    store({grid, blur_z, blur_x, blur_y});
    differentiate(result, seed, {&picture, &brightness});
  }
};

}  // namespace

PROGRAM(gradient_bilateral_grid, GradientBilateralGrid,
        gradients_of({in<float>({512, 384}), in<float>({512, 384}, 0.02, 0.97)}, {512, 384}))

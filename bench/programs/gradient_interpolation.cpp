// gradient_interpolation -- fills missing pixels by a pyramid of 10 levels: alpha-weighted means downwards; each level
// shows through where the finer one is transparent. Gradients: the picture and its alpha.
#include "pyramid.h"

namespace {

struct GradientInterpolation : programs::GradientGenerator<GradientInterpolation> {
  Variable picture{"image", "picture", {512, 512, 4}};
  Seed seed{{512, 512, 3}};

  void generate() {
    programs::Pyramid pyramid;
    const int levels = 10;
    std::vector<Func> down(levels);
    std::vector<std::vector<int>> size = {{512, 512, 4}};
    down[0] = Func("down_0");
    down[0](x, y, c) = select(c == 3, 1.0f, picture(x, y, clamp(c, 0, 2))) * picture(x, y, 3);
    pyramid.stages.push_back(down[0]);
    for (int j = 1; j < levels; j++) {
      down[j] = pyramid.smaller(down[j - 1], size[j - 1], "down_" + std::to_string(j));
      size.push_back({programs::half(size[j - 1][0]), programs::half(size[j - 1][1]), 4});
    }
    Func result = down[levels - 1];
    for (int j = levels - 2; j >= 0; j--) {
      Func up = pyramid.larger(result, size[j + 1], "up_" + std::to_string(j));
      Func filled("filled_" + std::to_string(j));
      filled(x, y, c) = down[j](x, y, c) + (1.0f - down[j](x, y, 3)) * up(x, y, c);
      pyramid.stages.push_back(filled);
      result = filled;
    }
    Func colour("colour");
    colour(x, y, c) = result(x, y, c) / (result(x, y, 3) + 0.01f);
    store(pyramid.stages);
    differentiate(colour, seed, {&picture});
  }
};

}  // namespace

PROGRAM(gradient_interpolation, GradientInterpolation,
        gradients_of({in<float>({512, 512, 4}, 0.05, 1)}, {512, 512, 3}))

// gradient_unsharp -- a grey picture minus its blur, added back in the ratio of the colours. Gradients: picture and
// amount.
#include "gradient.h"

namespace {

struct GradientUnsharp : programs::GradientGenerator<GradientUnsharp> {
  Variable picture{"image", "picture", {512, 384, 3}}, gain{"amount", "gain", {1}};
  Seed seed{{512, 384, 3}};

  void generate() {
    const std::vector<int> size = {512, 384};
    Func grey("grey"), down("down"), across("across"), ratio("ratio"), result("result");
    grey(x, y) = 0.299f * picture(x, y, 0) + 0.587f * picture(x, y, 1) + 0.114f * picture(x, y, 2);
    const float weight[4] = {0.27f, 0.215f, 0.11f, 0.04f};
    auto blurred = [&](auto at) {
      Expr sum = weight[0] * at(0);
      for (int d = 1; d <= 3; d++) sum += weight[d] * (at(d) + at(-d));
      return sum;
    };
    down(x, y) = blurred([&](int d) { return programs::nearest(grey, size, {x, y + d}); });
    across(x, y) = blurred([&](int d) { return programs::nearest(down, size, {x + d, y}); });
    ratio(x, y) = (grey(x, y) + gain(0) * (grey(x, y) - across(x, y))) / grey(x, y);
    result(x, y, c) = ratio(x, y) * picture(x, y, c);
    store({grey, down, across, ratio});
    differentiate(result, seed, {&picture, &gain});
  }
};

}  // namespace

PROGRAM(gradient_unsharp, GradientUnsharp,
        gradients_of({in<float>({512, 384, 3}, 0.1, 1), in<float>({1}, 0.5, 1).noise()},
                     {512, 384, 3}))

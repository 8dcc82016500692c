// gradient_recursive_filter -- a running mean forwards along each column, and back. Gradients: the picture. There is no
// gradient with respect to the rate, which depends on intermediate values and which Halide rejects.
#include "gradient.h"

namespace {

struct GradientRecursiveFilter : programs::GradientGenerator<GradientRecursiveFilter> {
  Variable picture{"image", "picture", {384, 512}};
  Input<float> rate{"rate"};
  Seed seed{{384, 512}};

  void generate() {
    Func down("down"), up("up");
    RDom r(1, 511, "r"), s(1, 511, "s");
    Var t("t");
    down(x, y) = picture(x, y);
    down(x, r) = rate * picture(x, r) + (1.0f - rate) * down(x, r - 1);
    up(x, t) = down(x, 511 - t);
    up(x, s) = rate * down(x, 511 - s) + (1.0f - rate) * up(x, s - 1);
    Func result("result");
    result(x, y) = up(x, 511 - y);
    store({down, up});
    differentiate(result, seed, {&picture});
  }
};

}  // namespace

PROGRAM(gradient_recursive_filter, GradientRecursiveFilter,
        gradients_of({in<float>({384, 512}), value<float>(0.35f)}, {384, 512}))

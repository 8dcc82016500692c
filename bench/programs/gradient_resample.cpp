// gradient_resample -- shrinks a picture by a tent filter whose width follows from the scale; weights are computed once
// for each row and column. Gradients: the picture.
#include "gradient.h"

namespace {

struct GradientResample : programs::GradientGenerator<GradientResample> {
  Variable picture{"image", "picture", {512, 384, 3}};
  Seed seed{{230, 172, 3}};

  void generate() {
    const float scale = 0.45f, stretch = 1 / scale;
    Var n("n"), k("k");
    Func weights("weights"), tall("tall"), wide("wide");
    Expr place = (cast<float>(n) + 0.5f) / scale - 0.5f;
    auto first = [&](Expr at) {
      return cast<int>(ceil((cast<float>(at) + 0.5f) / scale - 0.5f - stretch));
    };
    auto tent = [&](Expr tap) {
      return max(0.0f, 1.0f - abs(cast<float>(first(n) + tap) - place) / stretch);
    };
    RDom r(0, 5, "r"), s(0, 5, "s"), all(0, 5, "all");
    Func total("total");
    total(n) += tent(all);
    weights(n, k) = tent(k) / total(n);
    tall(x, y, c) +=
        weights(y, r) * programs::nearest(picture, {512, 384, 3}, {x, first(y) + r, c});
    wide(x, y, c) += weights(x, s) * programs::nearest(tall, {512, 172, 3}, {first(x) + s, y, c});
    store({total, weights, tall, wide});
    differentiate(wide, seed, {&picture});
  }
};

}  // namespace

PROGRAM(gradient_resample, GradientResample,
        gradients_of({in<float>({512, 384, 3})}, {230, 172, 3}))

// gradient_wavelet -- a level of Daubechies' transform along x, with details shrunk towards zero, and its inverse.
// Gradients: picture and threshold.
#include "gradient.h"

namespace {

struct GradientWavelet : programs::GradientGenerator<GradientWavelet> {
  Variable picture{"image", "picture", {512, 384}}, limit{"threshold", "limit", {1}};
  Seed seed{{512, 384}};

  void generate() {
    const float h[4] = {0.48296291f, 0.83651630f, 0.22414387f, -0.12940952f};
    Func bands("bands"), shrunk("shrunk"), result("result");
    auto tap = [&](int i) { return programs::nearest(picture, {512, 384}, {2 * x + i, y}); };
    Expr average = h[0] * tap(0) + h[1] * tap(1) + h[2] * tap(2) + h[3] * tap(3);
    Expr detail = h[3] * tap(0) - h[2] * tap(1) + h[1] * tap(2) - h[0] * tap(3);
    bands(x, y, c) = select(c == 0, average, detail);
    Expr d = bands(x, y, 1), size = max(abs(d) - limit(0), 0.0f);
    shrunk(x, y, c) = select(c == 0, bands(x, y, 0), select(d < 0.0f, -size, size));
    auto at = [&](Expr px, int which) {
      return programs::nearest(shrunk, {256, 384, 2}, {px, y, which});
    };
    auto mix = [&](float a0, float d0, float a1, float d1) {
      return a0 * at(x / 2 - 1, 0) + d0 * at(x / 2 - 1, 1) + a1 * at(x / 2, 0) + d1 * at(x / 2, 1);
    };
    result(x, y) = select(x % 2 == 0, mix(h[2], h[1], h[0], h[3]), mix(h[3], -h[0], h[1], -h[2]));
    store({bands, shrunk});
    differentiate(result, seed, {&picture, &limit});
  }
};

}  // namespace

PROGRAM(gradient_wavelet, GradientWavelet,
        gradients_of({in<float>({512, 384}), in<float>({1}, 0.04, 0.05)}, {512, 384}))

// gradient_tone_curve -- maps each channel through a curve with 64 knots, by interpolation. Gradients: picture and
// curves.
#include "gradient.h"

namespace {

struct GradientToneCurve : programs::GradientGenerator<GradientToneCurve> {
  Variable picture{"image", "picture", {512, 384, 3}}, knots{"curve", "knots", {64, 3}};
  Seed seed{{512, 384, 3}};

  void generate() {
    Expr place = picture(x, y, c) * 63.0f, low = clamp(cast<int>(place), 0, 62);
    Func result("result");
    result(x, y, c) = lerp(knots(low, c), knots(low + 1, c), place - cast<float>(low));
    differentiate(result, seed, {&picture, &knots});
  }
};

}  // namespace

PROGRAM(gradient_tone_curve, GradientToneCurve,
        gradients_of({in<float>({512, 384, 3}, 0.01, 0.98), in<float>({64, 3})}, {512, 384, 3}))

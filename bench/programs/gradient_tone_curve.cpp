// gradient_tone_curve -- maps each channel through a curve with 64 knots, by interpolation. Gradients: picture and
// curves.
#include "gradient.h"

namespace {

class GradientToneCurve : public Halide::Generator<GradientToneCurve> {
 public:
  GeneratorParam<bool> primal{"primal", false};
  Input<Buffer<float>> image{"image", 3};
  Input<Buffer<float>> curve{"curve", 2};
  Input<Buffer<float>> seed{"seed", 3};
  Output<Buffer<double>> sum{"sum", 0};
  Output<Buffer<float>> d_image{"d_image", 3};
  Output<Buffer<float>> d_curve{"d_curve", 2};

  void generate() {
    Func picture = programs::values_of(image, "picture", {512, 384, 3});
    Func knots = programs::values_of(curve, "knots", {64, 3});

    Expr place = picture(x, y, c) * 63.0f, low = clamp(cast<int>(place), 0, 62);
    Func result("result");
    result(x, y, c) = lerp(knots(low, c), knots(low + 1, c), place - cast<float>(low));
    programs::Weighed weighed(result, seed, {512, 384, 3}, primal);
    sum() = weighed.sum();
    d_image = weighed.by(picture);
    programs::estimate(image, {512, 384, 3});
    programs::estimate(d_image, {512, 384, 3});
    d_curve = weighed.by(knots);
    programs::estimate(curve, {64, 3});
    programs::estimate(d_curve, {64, 3});
    programs::estimate(seed, {512, 384, 3});
    programs::estimate(sum, {});
  }

 private:
  Var x{"x"}, y{"y"}, c{"c"};
};

}  // namespace

PROGRAM(gradient_tone_curve, GradientToneCurve, at_sizes({{}}, [](const Sizes&) {
                                                  return std::vector{
                                                      in<float>({512, 384, 3}, 0.01, 0.98),
                                                      in<float>({64, 3}),
                                                      in<float>({512, 384, 3}, -1, 1).noise(),
                                                      out<double>({}),
                                                      out<float>({512, 384, 3}),
                                                      out<float>({64, 3})};
                                                }).gradients(2))

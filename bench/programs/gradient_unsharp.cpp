// gradient_unsharp -- a grey picture minus its blur, added back in the ratio of the colours. Gradients: picture and
// amount.
#include "gradient.h"

namespace {

class GradientUnsharp : public Halide::Generator<GradientUnsharp> {
 public:
  GeneratorParam<bool> primal{"primal", false};
  Input<Buffer<float>> image{"image", 3};
  Input<Buffer<float>> amount{"amount", 1};
  Input<Buffer<float>> seed{"seed", 3};
  Output<Buffer<double>> sum{"sum", 0};
  Output<Buffer<float>> d_image{"d_image", 3};
  Output<Buffer<float>> d_amount{"d_amount", 1};

  void generate() {
    Func picture = programs::values_of(image, "picture", {512, 384, 3});
    Func gain = programs::values_of(amount, "gain", {1});

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
    programs::store({grey, down, across, ratio}, primal);
    programs::Weighed weighed(result, seed, {512, 384, 3}, primal);
    sum() = weighed.sum();
    d_image = weighed.by(picture);
    programs::estimate(image, {512, 384, 3});
    programs::estimate(d_image, {512, 384, 3});
    d_amount = weighed.by(gain);
    programs::estimate(amount, {1});
    programs::estimate(d_amount, {1});
    programs::estimate(seed, {512, 384, 3});
    programs::estimate(sum, {});
  }

 private:
  Var x{"x"}, y{"y"}, c{"c"};
};

}  // namespace

PROGRAM(gradient_unsharp, GradientUnsharp, at_sizes({{}}, [](const Sizes&) {
                                             return std::vector{
                                                 in<float>({512, 384, 3}, 0.1, 1),
                                                 in<float>({1}, 0.5, 1).noise(),
                                                 in<float>({512, 384, 3}, -1, 1).noise(),
                                                 out<double>({}),
                                                 out<float>({512, 384, 3}),
                                                 out<float>({1})};
                                           }).gradients(2))

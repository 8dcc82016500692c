// gradient_recursive_filter -- a running mean forwards along each column, and back. Gradients: the picture. There is no
// gradient with respect to the rate, which depends on intermediate values and which Halide rejects.
#include "gradient.h"

namespace {

class GradientRecursiveFilter : public Halide::Generator<GradientRecursiveFilter> {
 public:
  GeneratorParam<bool> primal{"primal", false};
  Input<Buffer<float>> image{"image", 2};
  Input<float> rate{"rate"};
  Input<Buffer<float>> seed{"seed", 2};
  Output<Buffer<double>> sum{"sum", 0};
  Output<Buffer<float>> d_image{"d_image", 2};

  void generate() {
    Func picture = programs::values_of(image, "picture", {384, 512});

    Func down("down"), up("up");
    RDom r(1, 511, "r"), s(1, 511, "s");
    Var t("t");
    down(x, y) = picture(x, y);
    down(x, r) = rate * picture(x, r) + (1.0f - rate) * down(x, r - 1);
    up(x, t) = down(x, 511 - t);
    up(x, s) = rate * down(x, 511 - s) + (1.0f - rate) * up(x, s - 1);
    Func result("result");
    result(x, y) = up(x, 511 - y);
    programs::store({down, up}, primal);
    programs::Weighed weighed(result, seed, {384, 512}, primal);
    sum() = weighed.sum();
    d_image = weighed.by(picture);
    programs::estimate(image, {384, 512});
    programs::estimate(d_image, {384, 512});
    programs::estimate(seed, {384, 512});
    programs::estimate(sum, {});
  }

 private:
  Var x{"x"}, y{"y"}, c{"c"};
};

}  // namespace

PROGRAM(gradient_recursive_filter, GradientRecursiveFilter,
        at_sizes({{}}, [](const Sizes&) {
          return std::vector{in<float>({384, 512}), value<float>(0.35f),
                             in<float>({384, 512}, -1, 1).noise(), out<double>({}),
                             out<float>({384, 512})};
        }).gradients(1))

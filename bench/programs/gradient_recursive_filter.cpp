// gradient_recursive_filter -- a running mean forwards along each column, and back: by picture and
// rate.
#include "gradient.h"

namespace {

class GradientRecursiveFilter : public Halide::Generator<GradientRecursiveFilter> {
 public:
  GeneratorParam<bool> primal{"primal", false};
  Input<Buffer<float>> image{"image", 2};
  Input<Buffer<float>> share{"share", 1};
  Input<Buffer<float>> seed{"seed", 2};
  Output<Buffer<double>> sum{"sum", 0};
  Output<Buffer<float>> d_image{"d_image", 2};
  Output<Buffer<float>> d_share{"d_share", 1};

  void generate() {
    Func picture = programs::values_of(image, "picture", {384, 512});
    Func rate = programs::values_of(share, "rate", {1});

    Func down("down"), up("up");
    RDom r(1, 511, "r"), s(1, 511, "s");
    Var t("t");
    down(x, y) = picture(x, y);
    down(x, r) = down(x, r - 1) + rate(0) * (picture(x, r) - down(x, r - 1));
    up(x, t) = down(x, 511 - t);
    up(x, s) = up(x, s - 1) + rate(0) * (down(x, 511 - s) - up(x, s - 1));
    Func result("result");
    result(x, y) = up(x, 511 - y);
    programs::store({down, up}, primal);
    programs::Weighed weighed(result, seed, {384, 512}, primal);
    sum() = weighed.sum();
    d_image = weighed.by(picture);
    programs::estimate(image, {384, 512});
    programs::estimate(d_image, {384, 512});
    d_share = weighed.by(rate);
    programs::estimate(share, {1});
    programs::estimate(d_share, {1});
    programs::estimate(seed, {384, 512});
    programs::estimate(sum, {});
  }

 private:
  Var x{"x"}, y{"y"}, c{"c"};
};

}  // namespace

PROGRAM(gradient_recursive_filter, GradientRecursiveFilter,
        at_sizes({{}}, [](const Sizes&) {
          return std::vector{
              in<float>({384, 512}), in<float>({1}, 0.3, 0.4), in<float>({384, 512}, -1, 1).noise(),
              out<double>({}),       out<float>({384, 512}),   out<float>({1})};
        }).gradients(2))

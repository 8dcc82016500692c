// gradient_resample -- shrinks a picture by a tent filter whose width follows from the scale; weights are computed once
// for each row and column. Gradients: the picture.
#include "gradient.h"

namespace {

class GradientResample : public Halide::Generator<GradientResample> {
 public:
  GeneratorParam<bool> primal{"primal", false};
  Input<Buffer<float>> image{"image", 3};
  Input<Buffer<float>> seed{"seed", 3};
  Output<Buffer<double>> sum{"sum", 0};
  Output<Buffer<float>> d_image{"d_image", 3};

  void generate() {
    Func picture = programs::values_of(image, "picture", {512, 384, 3});

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
    programs::store({total, weights, tall, wide}, primal);
    programs::Weighed weighed(wide, seed, {230, 172, 3}, primal);
    sum() = weighed.sum();
    d_image = weighed.by(picture);
    programs::estimate(image, {512, 384, 3});
    programs::estimate(d_image, {512, 384, 3});
    programs::estimate(seed, {230, 172, 3});
    programs::estimate(sum, {});
  }

 private:
  Var x{"x"}, y{"y"}, c{"c"};
};

}  // namespace

PROGRAM(gradient_resample, GradientResample,
        at_sizes({{}}, [](const Sizes&) {
          return std::vector{in<float>({512, 384, 3}), in<float>({230, 172, 3}, -1, 1).noise(),
                             out<double>({}), out<float>({512, 384, 3})};
        }).gradients(1))

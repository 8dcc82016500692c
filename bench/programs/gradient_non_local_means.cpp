// gradient_non_local_means -- means over 7 x 7 windows, weighted by the similarity of 7 x 7 patches (Buades, Coll and
// Morel 2005). Gradients: picture and strength.
#include "gradient.h"

namespace {

class GradientNonLocalMeans : public Halide::Generator<GradientNonLocalMeans> {
 public:
  GeneratorParam<bool> primal{"primal", false};
  Input<Buffer<float>> image{"image", 2};
  Input<Buffer<float>> strength{"strength", 1};
  Input<Buffer<float>> seed{"seed", 2};
  Output<Buffer<double>> sum{"sum", 0};
  Output<Buffer<float>> d_image{"d_image", 2};
  Output<Buffer<float>> d_strength{"d_strength", 1};

  void generate() {
    Func picture = programs::values_of(image, "picture", {192, 144});
    Func decay = programs::values_of(strength, "decay", {1});

    const std::vector<int> size = {192, 144};
    Var dx("dx"), dy("dy");
    Func padded("padded"), distance("distance"), across("across"), patches("patches");
    Func weight("weight"), total("total"), result("result");
    padded(x, y) = programs::nearest(picture, size, {x, y});
    RDom p(-3, 7, "p"), q(-3, 7, "q"), window(-3, 7, -3, 7, "window");
    Expr difference = padded(x, y) - padded(x + dx, y + dy);
    distance(x, y, dx, dy) = difference * difference;
    across(x, y, dx, dy) += distance(x + p, y, dx, dy);
    patches(x, y, dx, dy) += across(x, y + q, dx, dy);
    weight(x, y, dx, dy) = exp(-decay(0) * patches(x, y, dx, dy));
    total(x, y, c) +=
        weight(x, y, window.x, window.y) * select(c == 0, padded(x + window.x, y + window.y), 1.0f);
    result(x, y) = total(x, y, 0) / total(x, y, 1);
    programs::store({padded, distance, across, patches, weight, total}, primal);
    programs::Weighed weighed(result, seed, {192, 144}, primal);
    sum() = weighed.sum();
    d_image = weighed.by(picture);
    programs::estimate(image, {192, 144});
    programs::estimate(d_image, {192, 144});
    d_strength = weighed.by(decay);
    programs::estimate(strength, {1});
    programs::estimate(d_strength, {1});
    programs::estimate(seed, {192, 144});
    programs::estimate(sum, {});
  }

 private:
  Var x{"x"}, y{"y"}, c{"c"};
};

}  // namespace

PROGRAM(gradient_non_local_means, GradientNonLocalMeans,
        at_sizes({{}}, [](const Sizes&) {
          return std::vector{
              in<float>({192, 144}), in<float>({1}, 2, 2.5), in<float>({192, 144}, -1, 1).noise(),
              out<double>({}),       out<float>({192, 144}), out<float>({1})};
        }).gradients(2))

// gradient_non_local_means -- means over 7 x 7 windows, weighted by the similarity of 7 x 7 patches (Buades, Coll and
// Morel 2005). Gradients: picture and strength.
#include "gradient.h"

namespace {

struct GradientNonLocalMeans : programs::GradientGenerator<GradientNonLocalMeans> {
  Variable picture{"image", "picture", {192, 144}}, decay{"strength", "decay", {1}};
  Seed seed{{192, 144}};

  void generate() {
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
    store({padded, distance, across, patches, weight, total});
    differentiate(result, seed, {&picture, &decay});
  }
};

}  // namespace

PROGRAM(gradient_non_local_means, GradientNonLocalMeans,
        gradients_of({in<float>({192, 144}), in<float>({1}, 2, 2.5)}, {192, 144}))

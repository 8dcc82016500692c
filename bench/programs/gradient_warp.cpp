// gradient_warp -- samples a picture bilinearly at positions given by a flow. Gradients: picture and flow.
#include "gradient.h"

namespace {

struct GradientWarp : programs::GradientGenerator<GradientWarp> {
  Variable picture{"image", "picture", {512, 384}}, motion{"flow", "motion", {512, 384, 2}};
  Seed seed{{512, 384}};

  void generate() {
    auto at = [&](Expr px, Expr py) { return programs::nearest(picture, {512, 384}, {px, py}); };
    Expr px = x + motion(x, y, 0), py = y + motion(x, y, 1);
    Expr ix = cast<int>(floor(px)), iy = cast<int>(floor(py)), fx = px - ix, fy = py - iy;
    Func warped("warped");
    warped(x, y) = lerp(lerp(at(ix, iy), at(ix + 1, iy), fx),
                        lerp(at(ix, iy + 1), at(ix + 1, iy + 1), fx), fy);
    differentiate(warped, seed, {&picture, &motion});
  }
};

}  // namespace

PROGRAM(gradient_warp, GradientWarp,
        gradients_of({in<float>({512, 384}), in<float>({512, 384, 2}, -4, 4)}, {512, 384}))

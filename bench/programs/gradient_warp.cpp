// gradient_warp -- samples a picture bilinearly at positions given by a flow. Gradients: picture and flow.
#include "gradient.h"

namespace {

class GradientWarp : public Halide::Generator<GradientWarp> {
 public:
  GeneratorParam<bool> primal{"primal", false};
  Input<Buffer<float>> image{"image", 2};
  Input<Buffer<float>> flow{"flow", 3};
  Input<Buffer<float>> seed{"seed", 2};
  Output<Buffer<double>> sum{"sum", 0};
  Output<Buffer<float>> d_image{"d_image", 2};
  Output<Buffer<float>> d_flow{"d_flow", 3};

  void generate() {
    Func picture = programs::values_of(image, "picture", {512, 384});
    Func motion = programs::values_of(flow, "motion", {512, 384, 2});

    auto at = [&](Expr px, Expr py) { return programs::nearest(picture, {512, 384}, {px, py}); };
    Expr px = x + motion(x, y, 0), py = y + motion(x, y, 1);
    Expr ix = cast<int>(floor(px)), iy = cast<int>(floor(py)), fx = px - ix, fy = py - iy;
    Func warped("warped");
    warped(x, y) = lerp(lerp(at(ix, iy), at(ix + 1, iy), fx),
                        lerp(at(ix, iy + 1), at(ix + 1, iy + 1), fx), fy);
    programs::Weighed weighed(warped, seed, {512, 384}, primal);
    sum() = weighed.sum();
    d_image = weighed.by(picture);
    programs::estimate(image, {512, 384});
    programs::estimate(d_image, {512, 384});
    d_flow = weighed.by(motion);
    programs::estimate(flow, {512, 384, 2});
    programs::estimate(d_flow, {512, 384, 2});
    programs::estimate(seed, {512, 384});
    programs::estimate(sum, {});
  }

 private:
  Var x{"x"}, y{"y"}, c{"c"};
};

}  // namespace

PROGRAM(gradient_warp, GradientWarp, at_sizes({{}}, [](const Sizes&) {
                                       return std::vector{in<float>({512, 384}),
                                                          in<float>({512, 384, 2}, -4, 4),
                                                          in<float>({512, 384}, -1, 1).noise(),
                                                          out<double>({}),
                                                          out<float>({512, 384}),
                                                          out<float>({512, 384, 2})};
                                     }).gradients(2))

// gradient_interpolation -- missing pixels filled by a pyramid of 10 levels: alpha-weighted means
// downwards, each level shining through where the finer one has nothing: by the picture and its
// alpha.
#include "gradient.h"

namespace {

class GradientInterpolation : public Halide::Generator<GradientInterpolation> {
 public:
  GeneratorParam<bool> primal{"primal", false};
  Input<Buffer<float>> image{"image", 3};
  Input<Buffer<float>> seed{"seed", 3};
  Output<Buffer<double>> sum{"sum", 0};
  Output<Buffer<float>> d_image{"d_image", 3};

  void generate() {
    Func picture = programs::values_of(image, "picture", {512, 512, 4});

    const int levels = 10;
    std::vector<Func> down(levels);
    std::vector<std::vector<int>> size = {{512, 512, 4}};
    down[0] = Func("down_0");
    down[0](x, y, c) = select(c == 3, 1.0f, picture(x, y, clamp(c, 0, 2))) * picture(x, y, 3);
    stages.push_back(down[0]);
    for (int j = 1; j < levels; j++) {
      down[j] = smaller(down[j - 1], size[j - 1], "down_" + std::to_string(j));
      size.push_back({half(size[j - 1][0]), half(size[j - 1][1]), 4});
    }
    Func result = down[levels - 1];
    for (int j = levels - 2; j >= 0; j--) {
      Func up = larger(result, size[j + 1], "up_" + std::to_string(j));
      Func filled("filled_" + std::to_string(j));
      filled(x, y, c) = down[j](x, y, c) + (1.0f - down[j](x, y, 3)) * up(x, y, c);
      stages.push_back(filled);
      result = filled;
    }
    Func colour("colour");
    colour(x, y, c) = result(x, y, c) / (result(x, y, 3) + 0.01f);
    programs::store(stages, primal);
    programs::Weighed weighed(colour, seed, {512, 512, 3}, primal);
    sum() = weighed.sum();
    d_image = weighed.by(picture);
    programs::estimate(image, {512, 512, 4});
    programs::estimate(d_image, {512, 512, 4});
    programs::estimate(seed, {512, 512, 3});
    programs::estimate(sum, {});
  }

 private:
  Var x{"x"}, y{"y"}, c{"c"};

  // Half the size, and twice: 1 3 3 1 along both axes, and what undoes it best.
  static int half(int n) { return (n + 1) / 2; }
  Func smaller(Func f, std::vector<int> size, const std::string& name) {
    auto smooth = [](auto at) { return (at(-1) + 3.0f * (at(0) + at(1)) + at(2)) * 0.125f; };
    Func rows(name + "_rows"), small(name);
    rows(x, y, c) = smooth([&](int d) { return programs::nearest(f, size, {x, 2 * y + d, c}); });
    const std::vector<int> narrow = {size[0], half(size[1]), size[2]};
    small(x, y, c) = smooth([&](int d) {
      return programs::nearest(rows, narrow, {2 * x + d, y, c});
    });
    stages.insert(stages.end(), {rows, small});
    return small;
  }
  Func larger(Func f, std::vector<int> size, const std::string& name) {
    Func rows(name + "_rows"), large(name);
    auto mix = [](Expr near, Expr far) { return 0.75f * near + 0.25f * far; };
    rows(x, y, c) = mix(programs::nearest(f, size, {x, y / 2, c}),
                        programs::nearest(f, size, {x, y / 2 - 1 + 2 * (y % 2), c}));
    const std::vector<int> tall = {size[0], 2 * size[1], size[2]};
    large(x, y, c) = mix(programs::nearest(rows, tall, {x / 2, y, c}),
                         programs::nearest(rows, tall, {x / 2 - 1 + 2 * (x % 2), y, c}));
    stages.insert(stages.end(), {rows, large});
    return large;
  }

  std::vector<Func> stages;
};

}  // namespace

PROGRAM(gradient_interpolation, GradientInterpolation,
        at_sizes({{}}, [](const Sizes&) {
          return std::vector{in<float>({512, 512, 4}, 0.05, 1),
                             in<float>({512, 512, 3}, -1, 1).noise(), out<double>({}),
                             out<float>({512, 512, 4})};
        }).gradients(1))

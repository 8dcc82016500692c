// local_laplacian -- enhances details without halos: pyramids of the picture remapped around eight greys, between which
// each level interpolates by its own grey (Paris, Hasinoff and Kautz 2011).
#include "program.h"

namespace {

struct LocalLaplacian : programs::Filter<LocalLaplacian, uint16_t, 3> {
  GeneratorParam<int> levels{"levels", 5};
  Input<float> detail{"detail"};

  void generate() {
    Func pixel = Halide::BoundaryConditions::repeat_edge(input);
    colour(x, y, c) = cast<float>(pixel(x, y, c)) / 65535.0f;
    grey(x, y) = 0.299f * colour(x, y, 0) + 0.587f * colour(x, y, 1) + 0.114f * colour(x, y, 2);
    Expr t = cast<float>(i) / 256.0f;
    remap(i) = detail * t * exp(-t * t / 2.0f);
    Expr centre = k * (1.0f / (greys - 1));
    Expr index = clamp(cast<int>((grey(x, y) - centre) * 256.0f), -256, 256);
    std::vector<Func> remapped(levels), own(levels), mixed(levels);
    remapped[0] = Func("remapped_0");
    remapped[0](x, y, k) = grey(x, y) + remap(index);
    own[0] = grey;
    for (int j = 1; j < levels; j++) {
      remapped[j] = down(remapped[j - 1], "remapped_" + std::to_string(j));
      own[j] = down(own[j - 1], "own_" + std::to_string(j));
    }
    Func result;
    for (int j = levels - 1; j >= 0; j--) {
      Expr place = clamp(own[j](x, y), 0.0f, 1.0f) * (greys - 1);
      Expr low = clamp(cast<int>(place), 0, greys - 2), share = place - low;
      auto laplacian = [&](Expr which) {
        Expr value = remapped[j](x, y, which);
        if (j < levels - 1) value -= up(remapped[j + 1])(x, y, which);
        return value;
      };
      mixed[j] = Func("mixed_" + std::to_string(j));
      Expr value = lerp(laplacian(low), laplacian(low + 1), share);
      if (j < levels - 1) value += up(result)(x, y);
      mixed[j](x, y) = value;
      result = mixed[j];
      whole.push_back(mixed[j]);
    }
    Expr gain = result(x, y) / max(grey(x, y), 0.005f);
    output(x, y, c) = cast<uint16_t>(clamp(colour(x, y, c) * gain, 0.0f, 1.0f) * 65535.0f);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    remap.compute_root();
    grey.compute_root().vectorize(x, lanes).parallel(y, 32);
    for (Func& f : whole) f.compute_root().vectorize(x, lanes).parallel(y, 16);
    output.bound(c, 0, 3).reorder(c, x, y).unroll(c).vectorize(x, lanes).parallel(y, 32);
  }

 private:
  static constexpr int greys = 8;

  Func down(Func f, const std::string& name) {
    using Halide::_;
    Func rows, small(name);
    rows(x, y, _) =
        (f(2 * x - 1, y, _) + 3.0f * (f(2 * x, y, _) + f(2 * x + 1, y, _)) + f(2 * x + 2, y, _)) /
        8.0f;
    small(x, y, _) = (rows(x, 2 * y - 1, _) + 3.0f * (rows(x, 2 * y, _) + rows(x, 2 * y + 1, _)) +
                      rows(x, 2 * y + 2, _)) /
                     8.0f;
    whole.push_back(small);
    return small;
  }

  Func up(Func f) {
    using Halide::_;
    Func rows, large;
    rows(x, y, _) = 0.25f * f(x / 2 - 1 + 2 * (x % 2), y, _) + 0.75f * f(x / 2, y, _);
    large(x, y, _) = 0.25f * rows(x, y / 2 - 1 + 2 * (y % 2), _) + 0.75f * rows(x, y / 2, _);
    return large;
  }

  Var k{"k"}, i{"i"};
  Func colour{"colour"}, grey{"grey"}, remap{"remap"};
  std::vector<Func> whole;
};

}  // namespace

PROGRAM(local_laplacian, LocalLaplacian,
        at_sizes({{128, 96}, {641, 481}, {1536, 1024}}, [](const Sizes& n) {
          return std::vector{in<uint16_t>({n[0], n[1], 3}, 0, 60000), value<float>(0.8f),
                             out<uint16_t>({n[0], n[1], 3})};
        }).tolerance(0.02))

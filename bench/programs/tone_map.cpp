// tone_map -- maps a high-contrast picture to a screen: exposure, a filmic curve per channel, gamma.
#include "program.h"

namespace {

struct ToneMap : programs::Filter<ToneMap, float, 3, uint8_t, 3> {
  Input<float> exposure{"exposure"}, gamma{"gamma"};

  void generate() {
    auto curve = [](Expr v) {
      return (v * (2.51f * v + 0.03f)) / (v * (2.43f * v + 0.59f) + 0.14f);
    };
    luma(x, y) = 0.2126f * input(x, y, 0) + 0.7152f * input(x, y, 1) + 0.0722f * input(x, y, 2);
    Expr strength = luma(x, y) * exposure, target = curve(strength);
    scale(x, y) = target / max(strength, 1e-4f) * exposure;
    Expr shown = pow(clamp(input(x, y, c) * scale(x, y), 0.0f, 1.0f), 1.0f / gamma);
    output(x, y, c) = cast<uint8_t>(shown * 255.0f + 0.5f);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    output.bound(c, 0, 3).reorder(x, c, y).vectorize(x, 2 * lanes).parallel(y, 8);
    scale.compute_at(output, y).vectorize(x, lanes);
  }

 private:
  Func luma{"luma"}, scale{"scale"};
};

}  // namespace

PROGRAM(tone_map, ToneMap, at_sizes({{129, 67}, {800, 601}, {2000, 1333}}, [](const Sizes& n) {
                             return std::vector{in<float>({n[0], n[1], 3}, 0, 8),
                                                value<float>(0.6f), value<float>(2.2f),
                                                out<uint8_t>({n[0], n[1], 3})};
                           }).tolerance(0.02))

// histogram_equalise -- equalises grey values: a histogram per strip, summed; its running sum is the curve for a
// gather.
#include "program.h"

namespace {

struct HistogramEqualise : programs::Filter<HistogramEqualise, uint8_t, 3> {
  void generate() {
    Expr r = input(x, y, 0), g = input(x, y, 1), b = input(x, y, 2);
    auto wide = [](Expr e) { return cast<uint16_t>(e); };
    luma(x, y) = cast<uint8_t>((77 * wide(r) + 150 * wide(g) + 29 * wide(b)) >> 8);
    Expr pixels = input.width() * input.height();
    px = RDom(0, input.width(), 0, input.height(), "px");
    histogram(v) = 0;
    histogram(clamp(cast<int>(luma(px.x, px.y)), 0, 255)) += 1;
    RDom below(1, 255);
    running(v) = histogram(v);
    running(below) += running(below - 1);
    curve(v) = cast<uint8_t>(clamp(running(v) * (255.0f / pixels), 0.0f, 255.0f));
    Expr old_luma = max(1, cast<int>(luma(x, y)));
    Expr gain = cast<int>(curve(luma(x, y))) * 256 / old_luma;
    output(x, y, c) = Halide::saturating_cast<uint8_t>((input(x, y, c) * gain + 128) >> 8);
  }

  void schedule() {
    const int lanes = natural_vector_size<uint8_t>();
    Var strip("strip"), yi("yi");
    RVar ro("ro"), ri("ri");
    luma.compute_root().vectorize(x, lanes).parallel(y, 16);
    histogram.compute_root().vectorize(v, 8);
    Func part = histogram.update().split(px.y, ro, ri, 32).rfactor(ro, strip);
    part.compute_root().vectorize(v, 8).update().parallel(strip);
    running.compute_root();
    curve.compute_root().vectorize(v, 8);
    output.bound(c, 0, 3).reorder(x, c, y).vectorize(x, lanes / 4).parallel(y, 16);
  }

 private:
  RDom px;
  Var v{"v"};
  Func luma{"luma"}, histogram{"histogram"}, running{"running"}, curve{"curve"};
};

}  // namespace

PROGRAM(histogram_equalise, HistogramEqualise,
        at_sizes({{129, 67}, {1000, 753}, {2400, 1600}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1], 3}, 20, 220), out<uint8_t>({n[0], n[1], 3})};
        }))

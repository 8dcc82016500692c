// integral_image -- sums of all pixels above and to the left, and from them the mean and deviation in a 15 x 15 square,
// as used for local contrast normalisation.
#include "program.h"

namespace {

struct IntegralImage : programs::Filter<IntegralImage, uint8_t, 2> {
  void generate() {
    Expr width = input.width(), height = input.height();
    along = RDom(1, width - 1, "along");
    down = RDom(1, height - 1, "down");
    Expr v = cast<uint32_t>(input(x, y));
    rows(x, y) = Halide::Tuple(v, v * v);
    rows(along, y) = Halide::Tuple(rows(along - 1, y)[0] + rows(along, y)[0],
                                   rows(along - 1, y)[1] + rows(along, y)[1]);
    sums(x, y) = Halide::Tuple(rows(x, y)[0], rows(x, y)[1]);
    sums(x, down) = Halide::Tuple(sums(x, down - 1)[0] + sums(x, down)[0],
                                  sums(x, down - 1)[1] + sums(x, down)[1]);
    Expr x0 = clamp(x - radius - 1, 0, width - 1), x1 = clamp(x + radius, 0, width - 1);
    Expr y0 = clamp(y - radius - 1, 0, height - 1), y1 = clamp(y + radius, 0, height - 1);
    auto inside = [&](int part) {
      return cast<float>(sums(x1, y1)[part] - sums(x0, y1)[part] - sums(x1, y0)[part] +
                         sums(x0, y0)[part]);
    };
    Expr area = cast<float>((x1 - x0) * (y1 - y0)), mean = inside(0) / area;
    Expr deviation = sqrt(max(inside(1) / area - mean * mean, 0.0f));
    Expr score = (cast<float>(input(x, y)) - mean) / (deviation + 4.0f);
    output(x, y) = Halide::saturating_cast<uint8_t>(128 + 48 * score);
  }

  void schedule() {
    const int lanes = natural_vector_size<uint32_t>();
    Var xo("xo"), xi("xi");
    rows.compute_root().vectorize(x, lanes).parallel(y, 16).update().parallel(y, 16);
    sums.compute_root().vectorize(x, lanes).parallel(y, 16);
    sums.update().split(x, xo, xi, 16 * lanes).reorder(xi, down, xo).vectorize(xi, lanes);
    sums.update().parallel(xo);
    output.vectorize(x, lanes).parallel(y, 16);
  }

 private:
  static constexpr int radius = 7;
  RDom along, down;
  Func rows{"rows"}, sums{"sums"};
};

}  // namespace

PROGRAM(integral_image, IntegralImage,
        at_sizes({{131, 67}, {1000, 753}, {2000, 1501}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1]}, 0, 255), out<uint8_t>({n[0], n[1]})};
        }).tolerance(0.02))

// rotate_bicubic -- rotates a picture about its centre, by Catmull and Rom's cubic (1974) over 4 x 4 pixels.
#include "program.h"

namespace {

struct RotateBicubic : programs::Filter<RotateBicubic, uint8_t, 3> {
  Input<float> angle{"angle"};

  void generate() {
    Expr width = input.width(), height = input.height();
    Expr co = cos(angle), si = sin(angle);
    Expr dx = x - width * 0.5f, dy = y - height * 0.5f;
    Expr sx = co * dx - si * dy + width * 0.5f, sy = si * dx + co * dy + height * 0.5f;
    place(x, y) =
        Halide::Tuple(cast<int>(floor(sx)), cast<int>(floor(sy)), sx - floor(sx), sy - floor(sy));
    Expr px = place(x, y)[0], py = place(x, y)[1], fx = place(x, y)[2], fy = place(x, y)[3];
    auto pixel = [&](Expr at_x, Expr at_y) {
      Expr value = input(clamp(at_x, 0, width - 1), clamp(at_y, 0, height - 1), c);
      return cast<float>(value);
    };
    Expr sum = 0.0f;
    for (int j = -1; j <= 2; j++) {
      Expr row = 0.0f;
      for (int i = -1; i <= 2; i++) row += cubic(fx, i) * pixel(px + i, py + j);
      sum += cubic(fy, j) * row;
    }
    output(x, y, c) = cast<uint8_t>(clamp(sum, 0.0f, 255.0f));
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var xi("xi"), yi("yi");
    output.bound(c, 0, 3).tile(x, y, xi, yi, 64, 16).reorder(xi, c, yi, x, y).parallel(y);
    output.vectorize(xi, lanes);
    place.compute_at(output, yi).vectorize(x, lanes);
  }

 private:
  // The weight of the pixel i positions after the one before t.
  static Expr cubic(Expr t, int i) {
    if (i == -1) return 0.5f * t * (-1.0f + t * (2.0f - t));
    if (i == 0) return 1.0f + 0.5f * t * t * (-5.0f + 3.0f * t);
    if (i == 1) return 0.5f * t * (1.0f + t * (4.0f - 3.0f * t));
    return 0.5f * t * t * (t - 1.0f);
  }

  Func place{"place"};
};

}  // namespace

PROGRAM(rotate_bicubic, RotateBicubic,
        at_sizes({{129, 67}, {640, 481}, {1600, 1200}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1], 3}, 0, 255), value<float>(0.3f),
                             out<uint8_t>({n[0], n[1], 3})};
        }).tolerance(0.05))

// canny_edges -- the thin edges of a grey picture (Canny 1986): blur, Sobel gradient, non-maximum suppression across
// the edge, two thresholds, weak edges kept next to strong ones.
#include "program.h"

namespace {

struct CannyEdges : programs::Filter<CannyEdges, uint8_t, 2> {
  Input<int> weak{"weak"}, strong{"strong"};

  void generate() {
    Func pixel = Halide::BoundaryConditions::repeat_edge(input);
    auto p = [&](int dx, int dy) { return cast<int16_t>(pixel(x + dx, y + dy)); };
    Expr sum = cast<int16_t>(0);
    for (int j = -1; j <= 1; j++) {
      for (int i = -1; i <= 1; i++) sum += p(i, j) * cast<int16_t>((2 - abs(i)) * (2 - abs(j)));
    }
    smooth(x, y) = sum >> 4;
    auto s = [&](int dx, int dy) { return smooth(x + dx, y + dy); };
    gx(x, y) = s(1, -1) - s(-1, -1) + 2 * (s(1, 0) - s(-1, 0)) + s(1, 1) - s(-1, 1);
    gy(x, y) = s(-1, 1) - s(-1, -1) + 2 * (s(0, 1) - s(0, -1)) + s(1, 1) - s(1, -1);
    auto size = [](Expr e) { return cast<int16_t>(Halide::abs(e)); };
    strength(x, y) = size(gx(x, y)) + size(gy(x, y));

    Expr dx = gx(x, y), dy = gy(x, y), ax = size(dx), ay = size(dy);
    Expr is_flat = 5 * ay < 2 * ax, is_steep = 5 * ax < 2 * ay, same_sign = (dx > 0) == (dy > 0);
    auto m = [&](int i, int j) { return Expr(strength(x + i, y + j)); };
    Expr before = select(is_flat, m(-1, 0), is_steep, m(0, -1), same_sign, m(-1, -1), m(1, -1));
    Expr after = select(is_flat, m(1, 0), is_steep, m(0, 1), same_sign, m(1, 1), m(-1, 1));
    Expr here = strength(x, y), is_ridge = here >= before && here > after;
    grade(x, y) =
        select(is_ridge && here >= cast<int16_t>(strong), cast<uint8_t>(2),
               is_ridge && here >= cast<int16_t>(weak), cast<uint8_t>(1), cast<uint8_t>(0));
    Expr most = cast<uint8_t>(0);
    for (int j = -1; j <= 1; j++) {
      for (int i = -1; i <= 1; i++) most = max(most, grade(x + i, y + j));
    }
    output(x, y) = select(grade(x, y) > 0 && most == 2, cast<uint8_t>(255), cast<uint8_t>(0));
  }

  void schedule() {
    const int lanes = natural_vector_size<int16_t>();
    Var yi("yi");
    output.split(y, y, yi, 32).parallel(y).vectorize(x, 2 * lanes);
    for (Func* f : {&smooth, &gx, &gy, &strength, &grade})
      f->store_at(output, y).compute_at(output, yi).vectorize(x, lanes);
  }

 private:
  static int abs(int v) { return v < 0 ? -v : v; }

  Func smooth{"smooth"}, gx{"gx"}, gy{"gy"}, strength{"strength"}, grade{"grade"};
};

}  // namespace

PROGRAM(canny_edges, CannyEdges,
        at_sizes({{129, 67}, {1000, 753}, {2400, 1601}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1]}, 0, 255), value<int32_t>(60),
                             value<int32_t>(140), out<uint8_t>({n[0], n[1]})};
        }))

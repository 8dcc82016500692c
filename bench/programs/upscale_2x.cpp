// upscale_2x -- doubles both sides: new pixels are interpolated by four taps (-1 9 9 -1) / 16, in 16-bit arithmetic,
// rows first.
#include "program.h"

namespace {

struct Upscale2x : programs::Filter<Upscale2x, uint8_t, 2> {
  void generate() {
    Func pixel = Halide::BoundaryConditions::repeat_edge(input);
    auto between = [](Expr a, Expr b, Expr c, Expr d) {
      Expr inner = 9 * (cast<int16_t>(b) + cast<int16_t>(c));
      Expr outer = cast<int16_t>(a) + cast<int16_t>(d);
      return Halide::saturating_cast<uint8_t>((inner - outer + 8) >> 4);
    };
    Expr h = y / 2;
    rows(x, y) = select(y % 2 == 0, pixel(x, h),
                        between(pixel(x, h - 1), pixel(x, h), pixel(x, h + 1), pixel(x, h + 2)));
    Expr i = x / 2;
    output(x, y) = select(x % 2 == 0, rows(i, y),
                          between(rows(i - 1, y), rows(i, y), rows(i + 1, y), rows(i + 2, y)));
  }

  void schedule() {
    Var yo("yo"), yi("yi"), xi("xi");
    const int lanes = natural_vector_size<uint8_t>();
    output.split(y, yo, y, 32).split(y, y, yi, 2, Halide::TailStrategy::RoundUp);
    output.split(x, x, xi, 2 * lanes).unroll(yi).vectorize(xi).reorder(xi, x, yi, y, yo);
    output.parallel(yo);
    rows.compute_at(output, y).vectorize(x, lanes).align_bounds(y, 2).unroll(y, 2);
  }

 private:
  Func rows{"rows"};
};

}  // namespace

PROGRAM(upscale_2x, Upscale2x, at_sizes({{80, 48}, {512, 384}, {1920, 1088}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1]}, 0, 255), out<uint8_t>({2 * n[0], 2 * n[1]})};
        }))

// demosaic -- colours from a Bayer mosaic of 16 bits (R G / G B), bilinear with green corrected by the gradient of red
// or blue (Malvar, He and Cutler 2004), interleaved output, white balance.
#include "program.h"

namespace {

struct Demosaic : programs::PictureGenerator<Demosaic> {
  Input<Buffer<uint16_t>> raw{"raw", 2};
  Input<float> red_gain{"red_gain"}, blue_gain{"blue_gain"};
  Output<Buffer<uint8_t>> output{"output", 3};

  void generate() {
    Func pixel = Halide::BoundaryConditions::mirror_interior(raw);
    wide(x, y) = cast<int>(pixel(x, y));
    auto p = [&](int dx, int dy) { return Expr(wide(x + dx, y + dy)); };
    Expr here = p(0, 0), cross = p(-1, 0) + p(1, 0) + p(0, -1) + p(0, 1);
    Expr far_x = p(-2, 0) + p(2, 0), far_y = p(0, -2) + p(0, 2);
    Expr corners = p(-1, -1) + p(1, -1) + p(-1, 1) + p(1, 1);
    Expr green = (4 * here + 2 * cross - far_x - far_y + 4) >> 3;
    Expr along_x =
        (10 * here + 8 * (p(-1, 0) + p(1, 0)) - 2 * corners - 2 * far_x + far_y + 8) >> 4;
    Expr along_y =
        (10 * here + 8 * (p(0, -1) + p(0, 1)) - 2 * corners - 2 * far_y + far_x + 8) >> 4;
    Expr across = (12 * here + 4 * corners - 3 * (far_x + far_y) + 8) >> 4;

    Expr even_x = x % 2 == 0, even_y = y % 2 == 0;
    Expr r = select(even_y, select(even_x, here, along_x), select(even_x, along_y, across));
    Expr g = select(even_x == even_y, green, here);
    Expr b = select(even_y, select(even_x, across, along_y), select(even_x, along_x, here));
    auto shown = [&](Expr v, Expr gain) {
      return cast<uint8_t>(clamp(cast<float>(v) * gain / 4.0f, 0.0f, 255.0f));
    };
    output(x, y, c) = mux(c, {shown(r, red_gain), shown(g, 1.0f), shown(b, blue_gain)});
  }

  void schedule() {
    const int lanes = natural_vector_size<uint16_t>();
    Var xi("xi"), yi("yi");
    output.dim(0).set_stride(3).set_min(0);
    output.dim(1).set_min(0);
    output.dim(2).set_stride(1).set_bounds(0, 3);
    output.split(y, y, yi, 2, Halide::TailStrategy::RoundUp);
    output.split(x, x, xi, 2, Halide::TailStrategy::RoundUp).reorder(c, xi, yi, x, y);
    output.unroll(c).unroll(xi).unroll(yi).vectorize(x, lanes).parallel(y, 8);
    wide.compute_at(output, y).vectorize(x, lanes);
  }

 private:
  Func wide{"wide"};
};

}  // namespace

PROGRAM(demosaic, Demosaic, at_sizes({{130, 64}, {1002, 754}, {2400, 1600}}, [](const Sizes& n) {
                              return std::vector{in<uint16_t>({n[0], n[1]}, 0, 1023),
                                                 value<float>(1.4f), value<float>(1.2f),
                                                 out<uint8_t>({n[0], n[1], 3}).interleaved()};
                            }).tolerance(0.02))

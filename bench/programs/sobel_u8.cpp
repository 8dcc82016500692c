// sobel_u8 -- the gradient magnitude of a grey picture of 8 bits (Sobel's operator), in 16 bits.
#include "program.h"

namespace {

struct SobelU8 : programs::Filter<SobelU8, uint8_t, 2> {
  void generate() {
    Func pixel = Halide::BoundaryConditions::repeat_edge(input);
    wide(x, y) = cast<int16_t>(pixel(x, y));
    across(x, y) = wide(x - 1, y) + 2 * wide(x, y) + wide(x + 1, y);
    down(x, y) = wide(x, y - 1) + 2 * wide(x, y) + wide(x, y + 1);
    Expr dx = Halide::absd(down(x + 1, y), down(x - 1, y));
    Expr dy = Halide::absd(across(x, y + 1), across(x, y - 1));
    output(x, y) = Halide::saturating_cast<uint8_t>((dx + dy) / 4);
  }

  void schedule() {
    Var yi("yi");
    const int lanes = natural_vector_size<uint8_t>();
    output.split(y, y, yi, 32).parallel(y).vectorize(x, lanes);
    wide.store_at(output, y).compute_at(output, yi).vectorize(x, lanes);
    across.store_at(output, y).compute_at(output, yi).vectorize(x, lanes);
  }

 private:
  Func wide{"wide"}, across{"across"}, down{"down"};
};

}  // namespace

PROGRAM(sobel_u8, SobelU8, at_sizes({{131, 70}, {1024, 767}, {4000, 3000}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1]}, 0, 255), out<uint8_t>({n[0], n[1]})};
        }))

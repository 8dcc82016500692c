// alpha_over -- composites one interleaved RGBA picture over another (Porter and Duff 1984), 8 bits, premultiplied
// colours.
#include "program.h"

namespace {

struct AlphaOver : programs::PictureGenerator<AlphaOver> {
  Input<Buffer<uint8_t>> top{"top", 3}, bottom{"bottom", 3};
  Output<Buffer<uint8_t>> output{"output", 3};

  void generate() {
    Expr clear = cast<uint16_t>(255 - top(x, y, 3));
    Expr below = clear * bottom(x, y, c) + 128;
    Expr dimmed = (below + (below >> 8)) >> 8;
    output(x, y, c) = Halide::saturating_cast<uint8_t>(top(x, y, c) + dimmed);
  }

  void schedule() {
    const int lanes = natural_vector_size<uint8_t>();
    for (auto* image : {&top, &bottom}) {
      (*image).dim(0).set_stride(4);
      (*image).dim(2).set_stride(1).set_bounds(0, 4);
    }
    output.dim(0).set_stride(4);
    output.dim(2).set_stride(1).set_bounds(0, 4);
    output.reorder(c, x, y).unroll(c).vectorize(x, lanes).parallel(y, 16);
  }
};

}  // namespace

PROGRAM(alpha_over, AlphaOver, at_sizes({{125, 70}, {1000, 750}, {3000, 2000}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1], 4}, 0, 255).interleaved(),
                             in<uint8_t>({n[0], n[1], 4}, 0, 255).interleaved(),
                             out<uint8_t>({n[0], n[1], 4}).interleaved()};
        }))

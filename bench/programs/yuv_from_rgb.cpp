// yuv_from_rgb -- interleaved RGB of 8 bits to luma and to chroma at half the size (BT.601, fixed
// point).
#include "program.h"

namespace {

struct YuvFromRgb : programs::PictureGenerator<YuvFromRgb> {
  Input<Buffer<uint8_t>> rgb{"rgb", 3};
  Output<Buffer<uint8_t>> luma{"luma", 2};
  Output<Buffer<uint8_t>> chroma{"chroma", 3};  // (x, y, c), interleaved

  void generate() {
    auto at = [&](Expr px, Expr py, int which) { return cast<int>(rgb(px, py, which)); };
    Expr bright = 66 * at(x, y, 0) + 129 * at(x, y, 1) + 25 * at(x, y, 2);
    luma(x, y) = cast<uint8_t>(((bright + 128) >> 8) + 16);
    auto four = [&](int which) {
      return (at(2 * x, 2 * y, which) + at(2 * x + 1, 2 * y, which) + at(2 * x, 2 * y + 1, which) +
              at(2 * x + 1, 2 * y + 1, which) + 2) >>
             2;
    };
    Expr r = four(0), g = four(1), b = four(2);
    Expr u = -38 * r - 74 * g + 112 * b, v = 112 * r - 94 * g - 18 * b;
    chroma(x, y, c) = cast<uint8_t>(((mux(c, {u, v}) + 128) >> 8) + 128);
  }

  void schedule() {
    const int lanes = natural_vector_size<uint8_t>();
    rgb.dim(0).set_stride(3);
    rgb.dim(2).set_stride(1).set_bounds(0, 3);
    chroma.dim(0).set_stride(2);
    chroma.dim(2).set_stride(1).set_bounds(0, 2);
    luma.vectorize(x, lanes).parallel(y, 16);
    chroma.reorder(c, x, y).unroll(c).vectorize(x, lanes / 2).parallel(y, 8);
  }
};

}  // namespace

PROGRAM(yuv_from_rgb, YuvFromRgb,
        at_sizes({{130, 70}, {1002, 754}, {3000, 2000}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1], 3}, 0, 255).interleaved(),
                             out<uint8_t>({n[0], n[1]}),
                             out<uint8_t>({n[0] / 2, n[1] / 2, 2}).interleaved()};
        }))

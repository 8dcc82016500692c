// chroma_420 -- converts interleaved RGB to planes of luma and half-size chroma, as video encoders take them: three
// outputs.
#include "program.h"

namespace {

struct Chroma420 : programs::PictureGenerator<Chroma420> {
  Input<Buffer<uint8_t>> rgb{"rgb", 3};
  Output<Buffer<uint8_t>> luma{"luma", 2}, blue{"blue", 2}, red{"red", 2};

  void generate() {
    auto at = [&](Expr i, Expr j, int c) { return cast<int>(rgb(i, j, c)); };
    luma(x, y) = cast<uint8_t>(
        (66 * at(x, y, 0) + 129 * at(x, y, 1) + 25 * at(x, y, 2) + 128 + 16 * 256) >> 8);
    mean(x, y, c) = (cast<uint16_t>(rgb(2 * x, 2 * y, c)) + rgb(2 * x + 1, 2 * y, c) +
                     rgb(2 * x, 2 * y + 1, c) + rgb(2 * x + 1, 2 * y + 1, c) + 2) /
                    4;
    auto m = [&](int c) { return cast<int>(mean(x, y, c)); };
    blue(x, y) = cast<uint8_t>((-38 * m(0) - 74 * m(1) + 112 * m(2) + 128 + 128 * 256) >> 8);
    red(x, y) = cast<uint8_t>((112 * m(0) - 94 * m(1) - 18 * m(2) + 128 + 128 * 256) >> 8);
  }

  void schedule() {
    const int lanes = natural_vector_size<uint8_t>();
    rgb.dim(0).set_stride(3);
    rgb.dim(2).set_stride(1).set_bounds(0, 3);
    luma.compute_root().vectorize(x, lanes).parallel(y, 16);
    Var yo("yo"), xi("xi");
    for (Func f : {Func(blue), Func(red)})
      f.compute_root().split(y, yo, y, 8).split(x, x, xi, lanes / 2).vectorize(xi).parallel(yo);
    Func(red).compute_with(blue, x);
    mean.compute_at(blue, x).bound(c, 0, 3).unroll(c).vectorize(x, lanes / 2);
  }

 private:
  Func mean{"mean"};
};

}  // namespace

PROGRAM(chroma_420, Chroma420, at_sizes({{128, 72}, {1024, 768}, {3840, 2160}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1], 3}, 0, 255).interleaved(),
                             out<uint8_t>({n[0], n[1]}), out<uint8_t>({n[0] / 2, n[1] / 2}),
                             out<uint8_t>({n[0] / 2, n[1] / 2})};
        }))

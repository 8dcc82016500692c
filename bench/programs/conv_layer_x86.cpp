// conv_layer_x86 -- a 3 x 3 convolution with many channels, bias and ReLU. Channels are innermost. Tiles of 2 vectors
// of them by 5 pixels stay in registers; weights and pixels are loaded once for all their uses.
#include "program.h"

namespace {

class ConvLayer : public Halide::Generator<ConvLayer> {
 public:
  Input<Buffer<float>> input{"input", 3};      // (channel, x, y)
  Input<Buffer<float>> weights{"weights", 4};  // (channel out, kx, ky, channel in)
  Input<Buffer<float>> bias{"bias", 1};
  Output<Buffer<float>> output{"output", 3};

  void generate() {
    r = RDom(0, input.dim(0).extent(), 0, 3, 0, 3, "r");
    conv(c, x, y) = bias(c);
    conv(c, x, y) += weights(c, r.y, r.z, r.x) * input(r.x, x + r.y, y + r.z);
    output(c, x, y) = max(0.0f, conv(c, x, y));
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var ci("ci"), xi("xi");
    output.split(c, c, ci, 2 * lanes).split(x, x, xi, 5).reorder(ci, xi, x, y, c);
    output.vectorize(ci, lanes).unroll(ci).unroll(xi).parallel(y).parallel(c);
    conv.compute_at(output, x).vectorize(c, lanes).unroll(c).unroll(x);
    conv.update().reorder(c, x, y, r.x, r.y, r.z).vectorize(c, lanes).unroll(c).unroll(x);
    conv.update().unroll(r.x, 2);
    weights.in().compute_at(conv, r.x).vectorize(Halide::_0, lanes).unroll(Halide::_0);
    input.in().compute_at(conv, x).unroll(Halide::_0);
    weights.dim(1).set_bounds(0, 3).dim(2).set_bounds(0, 3);
  }

 private:
  Var c{"c"}, x{"x"}, y{"y"};
  RDom r;
  Func conv{"conv"};
};

}  // namespace

PROGRAM(conv_layer_x86, ConvLayer,
        at_sizes({{16, 32, 15, 11}, {32, 32, 60, 45}, {64, 64, 100, 80}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[2] + 2, n[3] + 2}),
                             in<float>({n[1], 3, 3, n[0]}, -0.1, 0.1).noise(),
                             in<float>({n[1]}, -1, 1).noise(), out<float>({n[1], n[2], n[3]})};
        }))

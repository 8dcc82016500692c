// depthwise_conv -- filters each channel by its own 3 x 3 filter, then mixes all channels at each pixel.
#include "program.h"

namespace {

class DepthwiseConv : public Halide::Generator<DepthwiseConv> {
 public:
  Input<Buffer<float>> input{"input", 3};    // (channel, x, y)
  Input<Buffer<float>> filter{"filter", 3};  // (channel, kx, ky)
  Input<Buffer<float>> mixing{"mixing", 2};  // (channel out, channel in)
  Output<Buffer<float>> output{"output", 3};

  void generate() {
    Func padded = Halide::BoundaryConditions::constant_exterior(
        input, 0.0f,
        {{Expr(), Expr()},
         {input.dim(1).min(), input.dim(1).extent()},
         {input.dim(2).min(), input.dim(2).extent()}});
    k = RDom(0, 3, 0, 3, "k");
    channels = RDom(0, input.dim(0).extent(), "channels");
    spatial(c, x, y) += filter(c, k.x, k.y) * padded(c, x + k.x - 1, y + k.y - 1);
    mixed(c, x, y) += mixing(c, channels) * spatial(channels, x, y);
    output(c, x, y) = clamp(mixed(c, x, y), 0.0f, 6.0f);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var ci("ci"), xi("xi");
    output.split(c, c, ci, 2 * lanes).split(x, x, xi, 4).reorder(ci, xi, c, x, y).parallel(y);
    output.vectorize(ci, lanes).unroll(ci).unroll(xi);
    mixed.compute_at(output, c).vectorize(c, lanes).unroll(c).unroll(x);
    mixed.update().reorder(c, x, channels, y).vectorize(c, lanes).unroll(c).unroll(x);
    spatial.compute_at(output, x).vectorize(c, lanes);
    spatial.update().reorder(k.x, k.y, c, x).unroll(k.x).unroll(k.y).vectorize(c, lanes);
  }

 private:
  Var c{"c"}, x{"x"}, y{"y"};
  RDom k, channels;
  Func spatial{"spatial"}, mixed{"mixed"};
};

}  // namespace

PROGRAM(depthwise_conv, DepthwiseConv,
        at_sizes({{16, 32, 21, 17}, {32, 32, 80, 59}, {64, 128, 112, 112}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[2], n[3]}), in<float>({n[0], 3, 3}, -1, 1).noise(),
                             in<float>({n[1], n[0]}, -0.5, 0.5).noise(),
                             out<float>({n[1], n[2], n[3]})};
        }))

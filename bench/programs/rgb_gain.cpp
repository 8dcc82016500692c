// rgb_gain -- a pointwise operation on interleaved RGB that is the same for all channels: pixel and channel are fused
// to one dimension, which is vectorized.
#include "program.h"

namespace {

struct RgbGain : programs::Filter<RgbGain, uint8_t, 3> {
  Input<Buffer<uint8_t>> other{"other", 3};
  Input<float> gain{"gain"};

  void generate() {
    Expr fixed = cast<uint16_t>(gain * 256);
    Expr mixed =
        cast<uint32_t>(fixed) * input(x, y, c) + cast<uint32_t>(256 - fixed) * other(x, y, c);
    output(x, y, c) = Halide::saturating_cast<uint8_t>((mixed + 128) / 256);
  }

  void schedule() {
    Var cx("cx");
    for (auto* image : {&input, &other}) {
      (*image).dim(0).set_stride(3);
      (*image).dim(2).set_stride(1).set_bounds(0, 3);
    }
    output.dim(0).set_stride(3);
    output.dim(2).set_stride(1).set_bounds(0, 3);
    output.reorder(c, x, y).fuse(c, x, cx).vectorize(cx, natural_vector_size<uint8_t>());
    output.parallel(y, 8);
  }
};

}  // namespace

PROGRAM(rgb_gain, RgbGain, at_sizes({{127, 71}, {1000, 750}, {4000, 3000}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1], 3}, 0, 255).interleaved(),
                             in<uint8_t>({n[0], n[1], 3}, 0, 255).interleaved(), value<float>(0.3f),
                             out<uint8_t>({n[0], n[1], 3}).interleaved()};
        }))

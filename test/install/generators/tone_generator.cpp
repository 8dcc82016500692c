// A pipeline as a class: a blur over a window, weighted by a kernel image, then a tone curve.
#include "Halide.h"

namespace {

class Tone : public Halide::Generator<Tone> {
 public:
  GeneratorParam<int> radius{"radius", 1, 0, 8};
  GeneratorParam<bool> vectorize{"vectorize", true};
  GeneratorParam<bool> gpu{"gpu", false};
  Input<Buffer<float>> input{"input", 2};
  Input<Buffer<float>> kernel{"kernel", 1};
  Input<float> gain{"gain", 1.0f};
  Output<Buffer<float>> output{"output", 2};

  void generate() {
    Func clamped = Halide::BoundaryConditions::repeat_edge(input);
    RDom r(-radius.value(), 2 * radius + 1);
    blurred(x, y) = 0.0f;
    blurred(x, y) += clamped(x + r, y) * kernel(r + radius);
    output(x, y) = Halide::exp(blurred(x, y) * gain);
  }
  void schedule() {
    if (gpu) {
      output.gpu_tile(x, y, xi, yi, 8, 8);
      blurred.compute_at(output, xi);
      return;
    }
    output.parallel(y);
    if (vectorize) output.vectorize(x, natural_vector_size<float>());
    blurred.compute_at(output, y);
  }

 private:
  Var x{"x"}, y{"y"}, xi{"xi"}, yi{"yi"};
  Func blurred{"blurred"};
};

}  // namespace

HALIDE_REGISTER_GENERATOR(Tone, tone)

// A generator whose function has kernels, with producers and consumers alternating between device and host.
// test/unit/aot/aot_gpu_test.cpp calls it.
#include <retrograde/retrograde.h>

using namespace retrograde;

namespace {

class GpuFilter : public Generator<GpuFilter> {
 public:
  Input<Buffer<float>> input{"input", 2};
  Input<float> gain{"gain"};
  Output<Buffer<float>> output{"output", 2};

  void generate() {
    bright(x, y) = input(x, y) * gain;
    RDom row(0, input.height(), "row");
    column(x) = 0.0f;
    column(x) += bright(x, row);
    const Func edges =
        BoundaryConditions::constant_exterior(bright, 0.0f, 0, input.width(), 0, input.height());
    wide(x, y) = edges(x - 1, y) + edges(x, y) + edges(x + 1, y);
    output(x, y) = wide(x, y - 1) + wide(x, y + 1) - column(x);
  }
  void schedule() {
    bright.compute_root().gpu_tile(x, y, xi, yi, 32, 4);
    column.compute_root();
    output.gpu_tile(x, y, xi, yi, 16, 8);
    wide.compute_at(Func(output), x).gpu_threads(x, y);
  }

 private:
  Var x{"x"}, y{"y"}, xi{"xi"}, yi{"yi"};
  Func bright{"bright"}, column{"column"}, wide{"wide"};
};

}  // namespace

RETROGRADE_REGISTER_GENERATOR(GpuFilter, gpu_filter)

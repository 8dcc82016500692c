// separable_kernel -- convolves a picture along both axes, in tiles, with a kernel of any odd length that is an input.
#include "program.h"

namespace {

struct SeparableKernel : programs::Filter<SeparableKernel, float, 2> {
  Input<Buffer<float>> kernel{"kernel", 1};

  void generate() {
    Func pixel = Halide::BoundaryConditions::mirror_image(input);
    Expr taps = kernel.dim(0).extent(), radius = taps / 2;
    r = RDom(0, taps, "r");
    columns(x, y) += kernel(r) * pixel(x, y + r - radius);
    rows(x, y) += kernel(r) * columns(x + r - radius, y);
    output(x, y) = rows(x, y);
  }

  void schedule() {
    Var xi("xi"), yi("yi");
    const int lanes = natural_vector_size<float>();
    kernel.dim(0).set_min(0);
    output.tile(x, y, xi, yi, 128, 32).vectorize(xi, lanes).parallel(y);
    columns.compute_at(output, x).vectorize(x, lanes);
    columns.update().reorder(x, r, y).vectorize(x, lanes);
    rows.compute_at(output, yi).vectorize(x, lanes);
    rows.update().reorder(x, r).vectorize(x, lanes).unroll(x, 4);
  }

 private:
  RDom r;
  Func columns{"columns"}, rows{"rows"};
};

}  // namespace

PROGRAM(separable_kernel, SeparableKernel,
        at_sizes({{160, 90}, {1000, 749}, {2400, 1601}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1]}), in<float>({13}), out<float>({n[0], n[1]})};
        }))

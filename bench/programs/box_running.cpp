// box_running -- the mean over a window, with a cost independent of the radius: running sums along columns, then along
// rows, with lanes over the other axis.
#include "program.h"

namespace {

struct BoxRunning : programs::Filter<BoxRunning, float, 2> {
  Input<int> radius{"radius"};

  void generate() {
    Func pixel = Halide::BoundaryConditions::constant_exterior(input, 0.0f);
    Expr width = input.width(), height = input.height();
    ry = RDom(1, height - 1, "ry");
    down(x, y) = 0.0f;
    RDom first(-radius, 2 * radius + 1);
    down(x, 0) += pixel(x, first);
    down(x, ry) = down(x, ry - 1) + pixel(x, ry + radius) - pixel(x, ry - radius - 1);
    Func inside = Halide::BoundaryConditions::constant_exterior(down, 0.0f, 0, width, 0, height);
    rx = RDom(1, width - 1, "rx");
    across(x, y) = 0.0f;
    across(0, y) += inside(first, y);
    across(rx, y) = across(rx - 1, y) + inside(rx + radius, y) - inside(rx - radius - 1, y);
    Expr side = cast<float>(2 * radius + 1);
    output(x, y) = across(x, y) / (side * side);
  }

  void schedule() {
    Var xo("xo"), yo("yo"), yi("yi");
    const int lanes = natural_vector_size<float>();
    down.compute_root().vectorize(x, lanes).parallel(y, 32);
    down.update(0).vectorize(x, lanes);
    down.update(1).split(x, xo, x, 4 * lanes, Halide::TailStrategy::GuardWithIf);
    down.update(1).reorder(x, ry, xo).vectorize(x, lanes).parallel(xo);
    across.compute_root().vectorize(x, lanes).parallel(y, 32);
    across.update(0).parallel(y, 32);
    across.update(1).split(y, yo, yi, 8, Halide::TailStrategy::GuardWithIf);
    across.update(1).reorder(yi, rx, yo).unroll(yi).parallel(yo);
    output.vectorize(x, lanes).parallel(y, 32);
  }

 private:
  RDom rx, ry;
  Func down{"down"}, across{"across"};
};

}  // namespace

PROGRAM(box_running, BoxRunning,
        at_sizes({{160, 90}, {800, 601}, {2400, 1600}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1]}), value<int>(7), out<float>({n[0], n[1]})};
        }))

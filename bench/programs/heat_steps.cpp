// heat_steps -- four explicit steps of the heat equation with varying conductivity, in tiles that recompute their
// overlaps.
#include "program.h"

namespace {

struct HeatSteps : programs::PictureGenerator<HeatSteps> {
  Input<Buffer<float>> heat{"heat", 2}, conductivity{"conductivity", 2};
  Input<float> rate{"rate"};
  Output<Buffer<float>> output{"output", 2};

  void generate() {
    Func k = Halide::BoundaryConditions::repeat_edge(conductivity);
    Func now = Halide::BoundaryConditions::repeat_edge(heat);
    for (int s = 0; s < 4; s++) {
      Func next("step_" + std::to_string(s));
      auto flow = [&](int dx, int dy) {
        Expr between = (k(x, y) + k(x + dx, y + dy)) * 0.5f;
        return between * (now(x + dx, y + dy) - now(x, y));
      };
      next(x, y) = now(x, y) + rate * (flow(1, 0) + flow(-1, 0) + flow(0, 1) + flow(0, -1));
      steps.push_back(next);
      now = next;
    }
    output(x, y) = now(x, y);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var xi("xi"), yi("yi");
    output.tile(x, y, xi, yi, 256, 64).vectorize(xi, lanes).parallel(y);
    for (Func step : steps) step.compute_at(output, x).vectorize(x, lanes);
  }

 private:
  std::vector<Func> steps;
};

}  // namespace

PROGRAM(heat_steps, HeatSteps, at_sizes({{258, 66}, {1000, 749}, {2500, 1600}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1]}), in<float>({n[0], n[1]}), value<float>(0.2f),
                             out<float>({n[0], n[1]})};
        }))

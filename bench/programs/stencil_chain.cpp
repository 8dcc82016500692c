// stencil_chain -- twelve 5 x 5 stencils of 16 bits in sequence, in overlapping tiles: every third is stored
// completely, those between within the tiles of the next one.
#include "program.h"

namespace {

struct StencilChain : programs::Filter<StencilChain, uint16_t, 2> {
  void generate() {
    stages.push_back(Halide::BoundaryConditions::repeat_edge(input));
    for (int n = 1; n < 12; n++) {
      stages.emplace_back("stage_" + std::to_string(n));
      stages[n](x, y) = smoothed(stages[n - 1]);
    }
    output(x, y) = smoothed(stages.back());
  }

  void schedule() {
    const int lanes = natural_vector_size<uint16_t>();
    Func reader = output;
    for (int n = 11; n >= 0; n--) {
      if (n % 3 == 2) tile(reader, lanes);
      if (n == 0) return;
      if (n % 3 == 0)
        reader = stages[n].compute_root();
      else
        stages[n].compute_at(reader, x).vectorize(x, lanes);
    }
  }

 private:
  Expr smoothed(Func f) {
    const int weight[5] = {1, 4, 6, 4, 1};
    Expr sum = cast<uint16_t>(0);
    for (int j = 0; j < 5; j++) {
      for (int i = 0; i < 5; i++)
        sum += f(x + i - 2, y + j - 2) * cast<uint16_t>(weight[i] * weight[j]);
    }
    return sum / 256;
  }

  void tile(Func f, int lanes) {
    f.tile(x, y, xi, yi, 256, 64, Halide::TailStrategy::GuardWithIf).parallel(y);
    f.vectorize(xi, lanes);
  }

  Var xi{"xi"}, yi{"yi"};
  std::vector<Func> stages;
};

}  // namespace

PROGRAM(stencil_chain, StencilChain,
        at_sizes({{127, 71}, {1000, 750}, {2049, 1530}}, [](const Sizes& n) {
          return std::vector{in<uint16_t>({n[0], n[1]}, 0, 255), out<uint16_t>({n[0], n[1]})};
        }))

// max_filter -- the maximum over a 25 x 25 window: maxima over spans whose lengths are powers of two; two of them cover
// the window's side.
#include "program.h"

namespace {

struct MaxFilter : programs::Filter<MaxFilter, float, 3> {
  GeneratorParam<int> radius{"radius", 12};

  void generate() {
    Func pixel = Halide::BoundaryConditions::repeat_edge(input);
    const int side = 2 * radius + 1;
    int span = 1;
    Func down = pixel;
    for (; 2 * span <= side; span *= 2) {
      Func next("down_" + std::to_string(2 * span));
      next(x, y, c) = max(down(x, y, c), down(x, y + span, c));
      downs.push_back(next);
      down = next;
    }
    column(x, y, c) = max(down(x, y - radius, c), down(x, y + radius + 1 - span, c));
    Func across = column;
    for (int s = 1; s < span; s *= 2) {
      Func next("across_" + std::to_string(2 * s));
      next(x, y, c) = max(across(x, y, c), across(x + s, y, c));
      acrosses.push_back(next);
      across = next;
    }
    output(x, y, c) = max(across(x - radius, y, c), across(x + radius + 1 - span, y, c));
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var yi("yi");
    output.split(y, y, yi, 32).reorder(x, yi, y, c).parallel(y).parallel(c).vectorize(x, lanes);
    for (Func& f : downs) f.store_at(output, y).compute_at(output, yi).vectorize(x, lanes);
    column.compute_at(output, yi).vectorize(x, lanes);
    for (Func& f : acrosses) f.compute_at(output, yi).vectorize(x, lanes);
  }

 private:
  Func column{"column"};
  std::vector<Func> downs, acrosses;
};

}  // namespace

PROGRAM(max_filter, MaxFilter,
        at_sizes({{129, 67, 3}, {800, 601, 3}, {2000, 1500, 3}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1], n[2]}), out<float>({n[0], n[1], n[2]})};
        }))

// stencil_chain -- 40 stencils of 3 x 3 points in sequence.
//
// In groups of 8: a group runs in strips of rows, and within a strip each stage keeps the rows that the next one still
// reads.
#include "kernel.h"

namespace kernels {

Kernel stencil_chain(const Setup& setup) {
  const int width = setup.size(1536, 211), height = setup.size(1280, 149);
  const int stages = 40, group = 8;
  ImageParam input(Float(32), 2, "input");
  Var x("x"), y("y"), yi("yi");

  std::vector<Func> stage{BoundaryConditions::repeat_edge(input)};
  for (int s = 1; s <= stages; s++) {
    const Func& f = stage.back();
    Func next("stage_" + std::to_string(s));
    Expr cross = f(x - 1, y) + f(x + 1, y) + f(x, y - 1) + f(x, y + 1);
    Expr corners = f(x - 1, y - 1) + f(x + 1, y - 1) + f(x - 1, y + 1) + f(x + 1, y + 1);
    next(x, y) = 0.5f * f(x, y) + 0.1f * cross + 0.025f * corners;
    stage.push_back(next);
  }

  const int lanes = setup.lanes<float>();
  if (setup.by_hand()) {
    for (int last = group; last <= stages; last += group) {
      stage[last].compute_root().split(y, y, yi, 64).parallel(y).vectorize(x, lanes);
      for (int s = last - group + 1; s < last; s++)
        stage[s].store_at(stage[last], y).compute_at(stage[last], yi).vectorize(x, lanes);
    }
  }

  Buffer<float> image = make_image<float>({width, height});
  bind(input, image);
  Buffer<float> output(width, height);
  return {Pipeline(stage.back()), {image}, {output}, 11.0 * stages * width * height};
}

}  // namespace kernels

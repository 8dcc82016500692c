// non_local_means -- each pixel is a mean over a 7 x 7 window, weighted by the similarity of 7 x 7 neighbourhoods
// (Buades, Coll and Morel 2005). Distances of neighbourhoods are box sums, one axis after the other, that slide down
// within a tile.
#include "program.h"

namespace {

struct NonLocalMeans : programs::Filter<NonLocalMeans, float, 3> {
  Input<float> strength{"strength"};

  void generate() {
    Func pixel = Halide::BoundaryConditions::repeat_edge(input);
    window = RDom(-3, 7, -3, 7, "window");
    RDom patch(-3, 7), colour(0, 3);
    Expr difference = pixel(x, y, colour) - pixel(x + dx, y + dy, colour);
    distance(x, y, dx, dy) = sum(difference * difference, "colours");
    across(x, y, dx, dy) = sum(distance(x + patch, y, dx, dy), "across_sum");
    patches(x, y, dx, dy) = sum(across(x, y + patch, dx, dy), "down_sum");
    Expr likeness = fast_exp(-patches(x, y, dx, dy) * strength);
    weight(x, y, dx, dy) = likeness;
    with_one(x, y, c) = select(c == 3, 1.0f, pixel(x, y, clamp(c, 0, 2)));
    total(x, y, c) += weight(x, y, window.x, window.y) * with_one(x + window.x, y + window.y, c);
    output(x, y, c) = clamp(total(x, y, c) / total(x, y, 3), 0.0f, 1.0f);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    tile_colours(32);
    total.compute_at(output, x).bound(c, 0, 4).vectorize(x, lanes);
    total.update().reorder(x, c, y, window.x, window.y).unroll(c).vectorize(x, lanes);
    weight.compute_at(total, y).vectorize(x, lanes);
    across.store_at(total, window.x).compute_at(total, y).vectorize(x, lanes);
    distance.compute_at(total, y).vectorize(x, lanes);
  }

 private:
  Var dx{"dx"}, dy{"dy"};
  RDom window;
  Func distance{"distance"}, across{"across"}, patches{"patches"}, weight{"weight"};
  Func with_one{"with_one"}, total{"total"};
};

}  // namespace

PROGRAM(non_local_means, NonLocalMeans,
        at_sizes({{65, 39}, {255, 190}, {800, 600}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1], 3}), value<float>(0.35f),
                             out<float>({n[0], n[1], 3})};
        }))

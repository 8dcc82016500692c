// lens_blur -- depth of field from a depth map: each pixel is the mean over the disc of the pixels whose own circle of
// confusion covers it; colours are weighted by the inverse size of their circles.
#include "program.h"

namespace {

struct LensBlur : programs::Filter<LensBlur, float, 3> {
  Input<Buffer<float>> depth{"depth", 2};
  Input<float> focus{"focus"};

  void generate() {
    Func pixel = Halide::BoundaryConditions::repeat_edge(input);
    Func far_away = Halide::BoundaryConditions::repeat_edge(depth);
    Expr size = radius * Halide::abs(far_away(x, y) - focus);
    circle(x, y) = clamp(size, 0.5f, static_cast<float>(radius));
    weighted(x, y, c) =
        select(c == 3, 1.0f, pixel(x, y, clamp(c, 0, 2))) / (circle(x, y) * circle(x, y));
    r = RDom(-radius, 2 * radius + 1, -radius, 2 * radius + 1, "r");
    r.where(r.x * r.x + r.y * r.y <= radius * radius);
    Expr distance = cast<float>(r.x * r.x + r.y * r.y), reach = circle(x + r.x, y + r.y);
    Expr covers = distance <= reach * reach;
    total(x, y, c) += select(covers, weighted(x + r.x, y + r.y, c), 0.0f);
    output(x, y, c) = total(x, y, c) / max(total(x, y, 3), 1e-6f);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    tile_colours(16);
    circle.compute_at(output, x).vectorize(x, lanes);
    weighted.compute_at(output, x).reorder(c, x, y).bound(c, 0, 4).unroll(c).vectorize(x, lanes);
    total.compute_at(output, x).reorder(c, x, y).bound(c, 0, 4).unroll(c).vectorize(x, lanes);
    total.update().reorder(c, x, r.x, r.y, y).unroll(c).vectorize(x, lanes);
  }

 private:
  static constexpr int radius = 6;
  RDom r;
  Func circle{"circle"}, weighted{"weighted"}, total{"total"};
};

}  // namespace

PROGRAM(lens_blur, LensBlur, at_sizes({{129, 67}, {512, 385}, {1200, 800}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1], 3}), in<float>({n[0], n[1]}),
                             value<float>(0.3f), out<float>({n[0], n[1], 3})};
        }))

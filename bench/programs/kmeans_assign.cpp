// kmeans_assign -- the nearest of several colours for each pixel, and its distance (the first half of a step of
// k-means).
#include "program.h"

namespace {

struct KmeansAssign : programs::PictureGenerator<KmeansAssign> {
  Input<Buffer<float>> pixels{"pixels", 3};    // (x, y, c)
  Input<Buffer<float>> centres{"centres", 2};  // (c, k)
  Output<Buffer<int32_t>> label{"label", 2};
  Output<Buffer<float>> distance{"distance", 2};

  void generate() {
    r = RDom(0, centres.dim(1).extent(), "r");
    Expr sum = 0.0f;
    for (int c = 0; c < 3; c++) {
      Expr off = pixels(x, y, c) - centres(c, r);
      sum += off * off;
    }
    best(x, y) = Tuple(0, std::numeric_limits<float>::max());
    Expr nearer = sum < best(x, y)[1];
    best(x, y) = Tuple(select(nearer, r, best(x, y)[0]), select(nearer, sum, best(x, y)[1]));
    label(x, y) = best(x, y)[0];
    distance(x, y) = Halide::sqrt(best(x, y)[1]);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var xi("xi");
    centres.dim(1).set_min(0);
    for (Func f : {Func(distance), Func(label)})
      f.compute_root().vectorize(x, lanes).parallel(y, 8);
    best.compute_root().vectorize(x, lanes).parallel(y, 8);
    best.update().split(x, x, xi, 4 * lanes, Halide::TailStrategy::GuardWithIf);
    best.update().reorder(xi, r, x, y).vectorize(xi, lanes).unroll(xi).parallel(y);
  }

 private:
  RDom r;
  Func best{"best"};
};

}  // namespace

PROGRAM(kmeans_assign, KmeansAssign,
        at_sizes({{128, 70}, {640, 481}, {1920, 1080}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1], 3}), in<float>({3, 16}).noise(),
                             out<int32_t>({n[0], n[1]}), out<float>({n[0], n[1]})};
        }))

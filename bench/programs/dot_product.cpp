// dot_product -- of two long vectors, and their squares: each thread sums a part, in vectors.
#include "program.h"

namespace {

class DotProduct : public Halide::Generator<DotProduct> {
 public:
  Input<Buffer<float>> a{"a", 1}, b{"b", 1};
  Output<Buffer<float>> result{"result", 1};  // a.b, a.a, b.b

  void generate() {
    r = RDom(0, a.dim(0).extent(), "r");
    sums() = Halide::Tuple(0.0f, 0.0f, 0.0f);
    sums() =
        Halide::Tuple(sums()[0] + a(r) * b(r), sums()[1] + a(r) * a(r), sums()[2] + b(r) * b(r));
    result(i) = mux(i, {sums()[0], sums()[1], sums()[2]});
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var part("part"), lane("lane");
    RVar ro("ro"), ri("ri"), rv("rv");
    sums.compute_root();
    Func parts = sums.update().split(r, ro, ri, 16384).rfactor(ro, part);
    parts.compute_root();
    parts.update().parallel(part);
    Func in_lanes = parts.update().split(ri, ri, rv, 2 * lanes).rfactor(rv, lane);
    in_lanes.compute_at(parts, part).vectorize(lane, lanes).unroll(lane);
    in_lanes.update().reorder(lane, ri).vectorize(lane, lanes).unroll(lane);
    result.bound(i, 0, 3);
  }

 private:
  Var i{"i"};
  RDom r;
  Func sums{"sums"};
};

}  // namespace

PROGRAM(dot_product, DotProduct, at_sizes({{5001}, {200003}, {6000000}}, [](const Sizes& n) {
                                   return std::vector{in<float>({n[0]}, -1, 1).noise(),
                                                      in<float>({n[0]}, -1, 1).noise(),
                                                      out<float>({3})};
                                 }).tolerance(1e-3))

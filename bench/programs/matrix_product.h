// matrix_product.h -- C = A B in a floating-point type, column index first. Tiles of 4 rows by 3 vectors stay in
// registers while k runs. Sizes are arbitrary: tiles at the edges are guarded; interior tiles have no guards.
#pragma once

#include "program.h"

namespace programs {

class MatrixProduct : public Halide::Generator<MatrixProduct> {
 public:
  Input<Buffer<>> a{"a", 2};   // (k, i)
  Input<Buffer<>> b{"b", 2};   // (j, k)
  Output<Buffer<>> c{"c", 2};  // (j, i)

  void generate() {
    k = RDom(0, a.dim(0).extent(), "k");
    product(j, i) = Halide::cast(a.type(), 0);
    product(j, i) += a(k, i) * b(j, k);
    c(j, i) = product(j, i);
  }

  void schedule() {
    using Halide::TailStrategy;
    const int lanes = natural_vector_size(a.type()), wide = 3 * lanes, tall = 4;
    Var ji("ji"), ii("ii"), jt("jt"), it("it");
    c.tile(j, i, ji, ii, wide, tall, TailStrategy::GuardWithIf);
    c.vectorize(ji, lanes).unroll(ji).unroll(ii).reorder(ji, ii, i, j).parallel(j);
    c.specialize(c.dim(0).extent() % wide == 0 && c.dim(1).extent() % tall == 0);
    product.compute_at(c, i);
    product.tile(j, i, jt, it, wide, tall).vectorize(jt, lanes).unroll(jt).unroll(it);
    product.update()
        .tile(j, i, jt, it, wide, tall, TailStrategy::GuardWithIf)
        .reorder(jt, it, k, j, i);
    product.update().vectorize(jt, lanes).unroll(jt).unroll(it);
  }

 private:
  Var j{"j"}, i{"i"};
  RDom k;
  Func product{"product"};
};

template <typename T>
Registered products() {
  const std::string name = "float" + std::to_string(8 * sizeof(T));
  return at_sizes({{96, 96, 96}, {250, 333, 187}, {768, 768, 768}},
                  [](const Sizes& n) {
                    return std::vector{in<T>({n[2], n[1]}, -1, 1).noise(),
                                       in<T>({n[0], n[2]}, -1, 1).noise(), out<T>({n[0], n[1]})};
                  })
      .with("a.type=" + name)
      .with("b.type=" + name)
      .with("c.type=" + name);
}

}  // namespace programs

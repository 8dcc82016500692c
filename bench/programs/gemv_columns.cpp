// gemv_columns -- a transposed matrix times a vector: adds columns, with blocks of the result's rows in registers.
#include "program.h"

namespace {

class GemvColumns : public Halide::Generator<GemvColumns> {
 public:
  Input<Buffer<float>> matrix{"matrix", 2};  // (row of the result, k)
  Input<Buffer<float>> vector{"vector", 1};
  Output<Buffer<float>> result{"result", 1};

  void generate() {
    k = RDom(0, matrix.dim(1).extent(), "k");
    total(i) += matrix(i, k) * vector(k);
    result(i) = total(i);
  }

  void schedule() {
    using Halide::TailStrategy;
    const int lanes = natural_vector_size<float>(), block = 8 * lanes;
    Var ii("ii"), it("it");
    result.split(i, i, ii, block, TailStrategy::GuardWithIf).vectorize(ii, lanes).parallel(i);
    total.compute_at(result, i).split(i, i, it, block).vectorize(it, lanes).unroll(it);
    total.update().split(i, i, it, block, TailStrategy::GuardWithIf).reorder(it, k, i);
    total.update().vectorize(it, lanes).unroll(it).unroll(k, 2);
    result.specialize(result.dim(0).extent() % block == 0);
  }

 private:
  Var i{"i"};
  RDom k;
  Func total{"total"};
};

}  // namespace

PROGRAM(gemv_columns, GemvColumns,
        at_sizes({{101, 67}, {512, 511}, {3000, 2001}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1]}, -1, 1).noise(),
                             in<float>({n[1]}, -1, 1).noise(), out<float>({n[0]})};
        }))

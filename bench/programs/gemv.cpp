// gemv -- y = a A x + b y: each row of the matrix times a vector, in one partial sum per lane. Elements of a row may
// have any stride; usually they are dense.
#include "program.h"

namespace {

class Gemv : public Halide::Generator<Gemv> {
 public:
  Input<float> alpha{"alpha"}, beta{"beta"};
  Input<Buffer<float>> matrix{"matrix", 2};  // (column, row)
  Input<Buffer<float>> vector{"vector", 1};
  Input<Buffer<float>> addend{"addend", 1};
  Output<Buffer<float>> result{"result", 1};

  void generate() {
    const int lanes = 4 * natural_vector_size<float>();
    Expr columns = matrix.dim(0).extent(), whole = columns / lanes;
    blocks = RDom(0, whole, "blocks");
    RDom lane(0, lanes), rest(whole * lanes, columns - whole * lanes);
    partial(l, i) += matrix(blocks * lanes + l, i) * vector(blocks * lanes + l);
    total(i) =
        sum(partial(lane, i), "over_lanes") + sum(matrix(rest, i) * vector(rest), "rest_sum");
    result(i) = alpha * total(i) + beta * addend(i);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var ii("ii");
    matrix.dim(0).set_stride(Expr());
    result.split(i, i, ii, 32, Halide::TailStrategy::GuardWithIf).parallel(i);
    total.compute_at(result, ii);
    partial.compute_at(result, ii).vectorize(l, lanes).unroll(l);
    partial.update().reorder(l, blocks, i).vectorize(l, lanes).unroll(l);
    result.specialize(matrix.dim(0).stride() == 1);
  }

 private:
  Var i{"i"}, l{"l"};
  RDom blocks;
  Func partial{"partial"}, total{"total"};
};

}  // namespace

PROGRAM(gemv, Gemv, at_sizes({{101, 67}, {512, 511}, {3000, 2001}}, [](const Sizes& n) {
          return std::vector{value<float>(1.5f),
                             value<float>(0.5f),
                             in<float>({n[0], n[1]}, -1, 1).noise(),
                             in<float>({n[0]}, -1, 1).noise(),
                             in<float>({n[1]}, -1, 1).noise(),
                             out<float>({n[1]})};
        }))

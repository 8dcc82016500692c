// gemm_u8 -- a product of 8-bit matrices in 32 bits, as in quantised networks. B is packed in groups of four rows, so
// that each lane adds four products at a time.
#include "program.h"

namespace {

class GemmU8 : public Halide::Generator<GemmU8> {
 public:
  Input<Buffer<uint8_t>> a{"a", 2};   // (k, i); the extent of k is a multiple of four
  Input<Buffer<int8_t>> b{"b", 2};    // (j, k)
  Output<Buffer<int32_t>> c{"c", 2};  // (j, i)

  void generate() {
    fours = RDom(0, 4, 0, a.dim(0).extent() / 4, "fours");
    packed(q, j, k) = b(j, 4 * k + q);
    product(j, i) += cast<int32_t>(a(4 * fours.y + fours.x, i)) * packed(fours.x, j, fours.y);
    c(j, i) = product(j, i);
  }

  void schedule() {
    using Halide::TailStrategy;
    const int lanes = natural_vector_size<int32_t>(), wide = 2 * lanes, tall = 4;
    Var ji("ji"), ii("ii"), jt("jt"), it("it");
    packed.compute_root().bound(q, 0, 4).unroll(q).vectorize(j, 4 * lanes,
                                                             TailStrategy::GuardWithIf);
    packed.parallel(k, 8, TailStrategy::GuardWithIf);
    c.tile(j, i, ji, ii, wide, tall, TailStrategy::GuardWithIf).reorder(ji, ii, i, j).parallel(j);
    c.vectorize(ji, lanes).unroll(ji).unroll(ii);
    product.compute_at(c, i).tile(j, i, jt, it, wide, tall).vectorize(jt, lanes);
    product.unroll(jt).unroll(it);
    product.update().tile(j, i, jt, it, wide, tall, TailStrategy::GuardWithIf);
    product.update().reorder(fours.x, jt, it, fours.y, j, i).vectorize(jt, lanes);
    product.update().unroll(jt).unroll(it).atomic().vectorize(fours.x);
  }

 private:
  Var j{"j"}, i{"i"}, q{"q"}, k{"k"};
  RDom fours;
  Func packed{"packed"}, product{"product"};
};

}  // namespace

PROGRAM(gemm_u8, GemmU8,
        at_sizes({{48, 48, 64}, {250, 333, 188}, {512, 512, 512}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[2], n[1]}, 0, 255).noise(),
                             in<int8_t>({n[0], n[2]}, -128, 127).noise(),
                             out<int32_t>({n[0], n[1]})};
        }))

// joint_histogram -- counts pairs of values of two pictures at the same pixel: scattered counts in one table per strip,
// then their sum, and the table's sums along each axis.
#include "program.h"

namespace {

class JointHistogram : public Halide::Generator<JointHistogram> {
 public:
  Input<Buffer<uint8_t>> first{"first", 2}, second{"second", 2};
  Output<Buffer<int32_t>> table{"table", 2}, sums{"sums", 2};

  void generate() {
    r = RDom(0, first.width(), 0, first.height(), "r");
    counts(u, v) = 0;
    counts(cast<int>(first(r.x, r.y)) / 4, cast<int>(second(r.x, r.y)) / 4) += 1;
    RDom all(0, 64);
    table(u, v) = counts(u, v);
    sums(u, v) = sum(select(v == 0, counts(u, all), counts(all, u)), "along");
  }

  void schedule() {
    Var strip("strip");
    RVar ro("ro"), ri("ri");
    counts.compute_root().bound(u, 0, 64).bound(v, 0, 64).vectorize(u, 8);
    Func parts = counts.update().split(r.y, ro, ri, 64).rfactor(ro, strip);
    parts.compute_root().bound(u, 0, 64).bound(v, 0, 64).vectorize(u, 8).parallel(strip);
    parts.update().parallel(strip);
    counts.update().reorder(u, v, ro).vectorize(u, 8);
    table.vectorize(u, 8);
    sums.vectorize(u, 8);
  }

 private:
  Var u{"u"}, v{"v"};
  RDom r;
  Func counts{"counts"};
};

}  // namespace

PROGRAM(joint_histogram, JointHistogram,
        at_sizes({{129, 67}, {1000, 753}, {3000, 2001}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1]}, 0, 255),
                             in<uint8_t>({n[0], n[1]}, 0, 255).noise(), out<int32_t>({64, 64}),
                             out<int32_t>({64, 2})};
        }))

// template_sad -- compares a small picture with each part of a large one: the sum of absolute differences over a window
// whose size is only known at run time.
#include "program.h"

namespace {

struct TemplateSad : programs::PictureGenerator<TemplateSad> {
  Input<Buffer<uint8_t>> scene{"scene", 2}, pattern{"pattern", 2};
  Output<Buffer<uint32_t>> output{"output", 2};

  void generate() {
    r = RDom(0, pattern.width(), 0, pattern.height(), "r");
    Expr apart = Halide::absd(scene(x + r.x, y + r.y), pattern(r.x, r.y));
    sum(x, y) += cast<uint32_t>(apart);
    output(x, y) = sum(x, y);
  }

  void schedule() {
    const int lanes = natural_vector_size<uint8_t>();
    Var xi("xi"), yi("yi");
    pattern.dim(0).set_min(0);
    pattern.dim(1).set_min(0);
    output.tile(x, y, xi, yi, lanes, 4).vectorize(xi).unroll(yi).parallel(y);
    sum.compute_at(output, x).vectorize(x).unroll(y);
    sum.update().reorder(x, y, r.x, r.y).vectorize(x).unroll(y);
  }

 private:
  RDom r;
  Func sum{"sum"};
};

}  // namespace

PROGRAM(template_sad, TemplateSad, at_sizes({{96, 50}, {320, 241}, {960, 540}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0] + 16, n[1] + 16}, 0, 255),
                             in<uint8_t>({16, 16}, 0, 255), out<uint32_t>({n[0], n[1]})};
        }))

// stereo_match -- the disparity of each pixel between two pictures of 8 bits: the shift, of 32, with the least sum of
// absolute differences over 9 x 9 pixels.
#include "program.h"

namespace {

struct StereoMatch : programs::PictureGenerator<StereoMatch> {
  GeneratorParam<int> shifts{"shifts", 32};
  Input<Buffer<uint8_t>> left{"left", 2}, right{"right", 2};
  Output<Buffer<uint8_t>> output{"output", 2};

  void generate() {
    Func l = Halide::BoundaryConditions::repeat_edge(left);
    Func r = Halide::BoundaryConditions::repeat_edge(right);
    cost(x, y, d) = cast<uint16_t>(absd(l(x, y), r(x - d, y)));
    RDom window(-4, 9), other(-4, 9);
    down(x, y, d) += cost(x, y + window, d);
    square(x, y, d) += down(x + other, y, d);
    s = RDom(0, shifts, "s");
    best(x, y) = Halide::Tuple(cast<uint16_t>(65535), cast<uint8_t>(0));
    Expr is_better = square(x, y, s) < best(x, y)[0];
    best(x, y) = Halide::Tuple(select(is_better, square(x, y, s), best(x, y)[0]),
                               select(is_better, cast<uint8_t>(s), best(x, y)[1]));
    output(x, y) = best(x, y)[1];
  }

  void schedule() {
    const int lanes = natural_vector_size<uint16_t>();
    Var xi("xi"), yi("yi");
    output.tile(x, y, xi, yi, 128, 16).vectorize(xi, lanes).parallel(y);
    best.compute_at(output, x).vectorize(x, lanes);
    best.update().reorder(x, y, s).vectorize(x, lanes);
    square.compute_at(best, y).vectorize(x, lanes).update().vectorize(x, lanes);
    down.store_at(best, s).compute_at(best, y).vectorize(x, lanes).update().vectorize(x, lanes);
  }

 private:
  Var d{"d"};
  RDom s;
  Func cost{"cost"}, down{"down"}, square{"square"}, best{"best"};
};

}  // namespace

PROGRAM(stereo_match, StereoMatch,
        at_sizes({{129, 67}, {450, 375}, {1200, 801}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1]}, 0, 255), in<uint8_t>({n[0], n[1]}, 0, 255),
                             out<uint8_t>({n[0], n[1]})};
        }))

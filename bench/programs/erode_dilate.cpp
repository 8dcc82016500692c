// erode_dilate -- an opening and a closing of a mask by 5 x 5 squares: separable minima and maxima of bytes.
#include "program.h"

namespace {

struct ErodeDilate : programs::Filter<ErodeDilate, uint8_t, 2> {
  void generate() {
    Func pixel = Halide::BoundaryConditions::constant_exterior(input, cast<uint8_t>(0));
    Func opened = filtered(filtered(pixel, true), false);
    Func closed = filtered(filtered(opened, false), true);
    output(x, y) = closed(x, y);
  }

  void schedule() {
    const int lanes = natural_vector_size<uint8_t>();
    Var yi("yi");
    output.split(y, y, yi, 64).parallel(y).vectorize(x, lanes);
    for (Func& f : stages) f.store_at(output, y).compute_at(output, yi).vectorize(x, lanes);
  }

 private:
  Func filtered(Func f, bool is_least) {
    RDom r(-2, 5), s(-2, 5);
    Func across, square;
    if (is_least) {
      across(x, y) = minimum(f(x + r, y));
      square(x, y) = minimum(across(x, y + s));
    } else {
      across(x, y) = maximum(f(x + r, y));
      square(x, y) = maximum(across(x, y + s));
    }
    stages.push_back(across);
    stages.push_back(square);
    return square;
  }

  std::vector<Func> stages;
};

}  // namespace

PROGRAM(erode_dilate, ErodeDilate,
        at_sizes({{129, 77}, {1000, 753}, {3000, 2001}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1]}, 0, 255), out<uint8_t>({n[0], n[1]})};
        }))

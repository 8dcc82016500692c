// mandelbrot -- the step, of 64, at which each point leaves the circle of radius 2, if any.
#include "program.h"

namespace {

class Mandelbrot : public Halide::Generator<Mandelbrot> {
 public:
  Input<float> left{"left"}, top{"top"}, step{"step"};
  Output<Buffer<int32_t>> output{"output", 2};

  void generate() {
    const int steps = 64;
    Expr cr = left + step * x, ci = top + step * y;
    t = RDom(1, steps, "t");
    z(x, y, k) = Halide::Tuple(0.0f, 0.0f);
    Expr re = z(x, y, t - 1)[0], im = z(x, y, t - 1)[1];
    z(x, y, t) = Halide::Tuple(clamp(re * re - im * im + cr, -1e4f, 1e4f),
                               clamp(2 * re * im + ci, -1e4f, 1e4f));
    RDom s(0, steps);
    Expr zr = z(x, y, s)[0], zi = z(x, y, s)[1];
    escape(x, y) = argmin(select(zr * zr + zi * zi < 4.0f, 1, 0), "first");
    output(x, y) = select(escape(x, y)[1] == 0, escape(x, y)[0], steps);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    output.vectorize(x, lanes).parallel(y);
    escape.compute_at(output, x).vectorize(x, lanes);
    z.compute_at(output, x).vectorize(x, lanes);
    z.update().reorder(x, t, y).vectorize(x, lanes);
  }

 private:
  Var x{"x"}, y{"y"}, k{"k"};
  RDom t;
  Func z{"z"}, escape{"escape"};
};

}  // namespace

PROGRAM(mandelbrot, Mandelbrot, at_sizes({{96, 61}, {400, 301}, {1000, 800}}, [](const Sizes& n) {
                                  return std::vector{value<float>(-2.0f), value<float>(-1.2f),
                                                     value<float>(3.0f / n[0]),
                                                     out<int32_t>({n[0], n[1]})};
                                }).tolerance(2))

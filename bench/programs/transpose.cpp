// transpose -- transposes a matrix of any stride, in square tiles that are loaded completely and stored transposed.
#include "program.h"

namespace {

struct Transpose : programs::Filter<Transpose, float, 2> {
  void generate() {
    block(x, y) = input(y, x);
    output(x, y) = block(x, y);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var xi("xi"), yi("yi");
    output.tile(x, y, xi, yi, lanes, lanes).vectorize(xi).unroll(yi).parallel(y);
    block.compute_at(output, x).vectorize(y, lanes).unroll(x);
  }

 private:
  Func block{"block"};
};

}  // namespace

PROGRAM(transpose, Transpose, at_sizes({{101, 67}, {1000, 753}, {4096, 4000}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1]}), out<float>({n[1], n[0]})};
        }))

// blur_u16 -- the mean of 3 x 3 pixels of 16 bits, one axis after the other.
#include "program.h"

namespace {

struct Blur : programs::Filter<Blur, uint16_t, 2> {
  void generate() {
    rows(x, y) = (input(x, y) + input(x + 1, y) + input(x + 2, y)) / 3;
    output(x, y) = (rows(x, y) + rows(x, y + 1) + rows(x, y + 2)) / 3;
  }

  // Strips slide down; each row of a strip is computed once.
  void schedule() {
    Var yi("yi");
    const int lanes = natural_vector_size<uint16_t>();
    output.split(y, y, yi, 32).parallel(y).vectorize(x, lanes);
    rows.store_at(output, y).compute_at(output, yi).vectorize(x, lanes);
  }

 private:
  Func rows{"rows"};
};

}  // namespace

PROGRAM(
    blur_u16, Blur, at_sizes({{131, 67}, {1023, 767}, {3072, 2048}}, [](const Sizes& n) {
      return std::vector{in<uint16_t>({n[0] + 2, n[1] + 2}, 0, 20000), out<uint16_t>({n[0], n[1]})};
    }))

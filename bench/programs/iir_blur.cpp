// iir_blur -- a recursive blur, forwards and backwards along y, then along x through a transpose.
#include "program.h"

namespace {

struct IirBlur : programs::Filter<IirBlur, float, 3> {
  Input<float> share{"share"};  // weight of the new value

  void generate() {
    Expr width = input.width(), height = input.height();
    first = blurred_columns(input, height, "first");
    turned(x, y, c) = first(y, x, c);
    second = blurred_columns(turned, width, "second");
    output(x, y, c) = second(y, x, c);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var xi("xi"), yi("yi");
    for (size_t i = 0; i < scans.size(); i++) {
      Func& scan = scans[i];
      scan.compute_root().reorder(y, x, c).split(x, x, xi, 4 * lanes).reorder(xi, y, x, c);
      scan.vectorize(xi, lanes).parallel(x).parallel(c);
      for (int update = 0; update < 2; update++) {
        auto stage = scan.update(update);
        stage.split(x, x, xi, 4 * lanes).reorder(xi, rows[i][update], x, c);
        stage.vectorize(xi, lanes).parallel(x).parallel(c);
      }
    }
    turned.compute_root().tile(x, y, xi, yi, lanes, lanes).vectorize(xi).parallel(y).parallel(c);
    output.tile(x, y, xi, yi, lanes, lanes).vectorize(xi).parallel(y).parallel(c);
  }

 private:
  template <typename F>
  Func blurred_columns(F& f, Expr height, const std::string& name) {
    Func scan(name);
    RDom down(1, height - 1), up(1, height - 1);
    scan(x, y, c) = f(x, y, c);
    scan(x, down, c) = (1 - share) * scan(x, down - 1, c) + share * scan(x, down, c);
    Expr row = height - 1 - up;
    scan(x, row, c) = (1 - share) * scan(x, row + 1, c) + share * scan(x, row, c);
    scans.push_back(scan);
    rows.push_back({down, up});
    return scan;
  }

  Func first, turned{"turned"}, second;
  std::vector<Func> scans;
  std::vector<std::vector<RDom>> rows;
};

}  // namespace

PROGRAM(iir_blur, IirBlur, at_sizes({{129, 67}, {800, 601}, {2000, 1504}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1], 3}), value<float>(0.2f),
                             out<float>({n[0], n[1], 3})};
        }))

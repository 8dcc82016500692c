// Parallel and vectorized reductions: rfactor splits an associative update into partial results.
#include "Halide.h"

#include <cstdio>

using namespace Halide;

int main() {
  Var x("x"), u("u"), v("v");
  Buffer<uint8_t> image(96, 64);
  image.for_each_element(
      [&](int i, int j) { image(i, j) = (uint8_t)((i * 7 + j * 11 + i * j) % 32); });

  {
    // A histogram as written: one serial loop.
    Func serial("serial");
    RDom r(image);
    serial(x) = 0;
    serial(image(r.x, r.y)) += 1;
    // The same histogram from one partial histogram per row, with all rows in parallel.
    Func rows("rows");
    RDom s(image);
    rows(x) = 0;
    rows(image(s.x, s.y)) += 1;
    Func partial = rows.update().rfactor(s.y, v);
    partial.compute_root().vectorize(x, 8).update().parallel(v);
    Buffer<int> a = serial.realize({256}), b = rows.realize({256});
    int differences = 0, sum = 0;
    for (int i = 0; i < 256; i++) differences += a(i) != b(i), sum += b(i);
    printf("histogram: %d differences, sum %d, %d\n", differences, sum, b(5));
  }
  {
    // A sum over blocks of columns.
    Func total("total");
    RDom r(0, 96, 0, 64);
    RVar xo("xo"), xi("xi");
    total() = 0;
    total() += cast<int>(image(r.x, r.y));
    total.update().split(r.x, xo, xi, 8);
    Func blocks = total.update().rfactor(xi, u);
    blocks.compute_root().vectorize(u).update().vectorize(u);
    Buffer<int> out = total.realize();
    printf("sum: %d\n", out());
  }
  {
    // Tuples work if all their values together are associative: here the darkest value and its
    // position.
    Func best("best");
    RDom r(0, 96, 0, 64);
    Expr value = (r.x * 37 + r.y * 53) % 101 + cast<int>(image(r.x, r.y)) + 1;
    best() = Tuple(1000, 0);
    best() = Tuple(min(best()[0], value), select(best()[0] < value, best()[1], r.x + 96 * r.y));
    Func rows = best.update().rfactor({{r.y, v}});
    rows.compute_root().update().parallel(v);
    Realization all = best.realize();
    Buffer<int> darkest = all[0], place = all[1];
    int px = place() % 96, py = place() / 96;
    printf("darkest: %d, there: %d\n", darkest(), (px * 37 + py * 53) % 101 + image(px, py) + 1);
  }
  {
    // Minimum and maximum over tiles.
    Func extent("extent");
    RDom r(0, 96, 0, 64);
    RVar xo("xo"), xi("xi"), yo("yo"), yi("yi");
    extent() = Tuple(cast<uint8_t>(255), cast<uint8_t>(0));
    extent() = Tuple(min(extent()[0], image(r.x, r.y)), max(extent()[1], image(r.x, r.y)));
    extent.update().tile(r.x, r.y, xo, yo, xi, yi, 16, 16);
    Func tiles = extent.update().rfactor({{xo, u}, {yo, v}});
    tiles.compute_root().update().parallel(v);
    Realization both = extent.realize();
    Buffer<uint8_t> low = both[0], high = both[1];
    printf("from %d to %d\n", low(), high());
  }
  return 0;
}

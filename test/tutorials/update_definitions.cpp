// Update definitions: reduction domains, histograms, scans, inline reductions.
#include "Halide.h"

#include <cstdio>

using namespace Halide;

template <typename T>
void show(const char* title, const Buffer<T>& values) {
  printf("%-12s", title);
  for (int i = values.min(0); i < values.min(0) + values.extent(0); i++) {
    printf(" %g", (double)values(i));
  }
  printf("\n");
}

int main() {
  Var x("x"), y("y");
  {
    // Update definitions change points of earlier definitions.
    Func f("f");
    f(x) = x;
    f(3) = 100;
    f(x) = f(x) + 5;
    f(x) *= 2;
    show("points", Buffer<int>(f.realize({6})));
    printf("%d updates\n", f.num_update_definitions());
  }
  {
    // A reduction domain is a loop, here over powers of two.
    Func powers("powers");
    RDom r(1, 9);
    powers(x) = 1;
    powers(r) = powers(r - 1) * 2;
    show("powers", Buffer<int>(powers.realize({10})));
  }
  {
    // A scatter (a histogram) and a scan (its running sum).
    Buffer<uint8_t> image(40, 30);
    image.for_each_element([&](int i, int j) { image(i, j) = (uint8_t)((i * j + i) % 8); });
    Func histogram("histogram"), cumulative("cumulative");
    RDom pixels(image);
    histogram(x) = 0;
    histogram(clamp(image(pixels.x, pixels.y), 0, 7)) += 1;
    RDom i(1, 7);
    cumulative(x) = histogram(x);
    cumulative(i) = cumulative(i - 1) + histogram(i);
    histogram.compute_root();
    show("histogram", Buffer<int>(histogram.realize({8})));
    show("cumulative", Buffer<int>(cumulative.realize({8})));
  }
  {
    // A two-dimensional reduction, with a schedule for the update only.
    Func table("table");
    RDom r(0, 4, 0, 3);
    table(x, y) = 0;
    table(x, y) += (x + r.x) * (y + r.y);
    Var yo("yo"), yi("yi");
    table.update().split(y, yo, yi, 2).parallel(yo).vectorize(x, 4);
    Buffer<int> out = table.realize({8, 6});
    printf("table        %d %d %d\n", out(0, 0), out(7, 0), out(7, 5));
  }
  {
    // Inline reductions: sums and extrema inside an expression.
    Func source("source"), stats("stats");
    source(x) = (x * 37) % 16;
    RDom r(0, 16);
    stats(x) = select(x == 0, sum(source(r)), x == 1, maximum(source(r)), x == 2,
                      minimum(source(r)), product(source(1 + r % 3)));
    show("stats", Buffer<int>(stats.realize({4})));
  }
  {
    // Exponential smoothing is a scan along rows; rows are independent and run in parallel.
    Func smooth("smooth");
    RDom r(1, 7);
    smooth(x, y) = cast<float>((x * 5 + y) % 4);
    smooth(r, y) = smooth(r - 1, y) * 0.5f + smooth(r, y) * 0.5f;
    smooth.update().parallel(y);
    Buffer<float> out = smooth.realize({8, 3});
    printf("smooth       %g %g %g\n", out(7, 0), out(7, 1), out(7, 2));
  }
  return 0;
}

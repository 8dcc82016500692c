// Predicated reductions: reduction domains that are not boxes.
#include "Halide.h"

#include <cstdio>

using namespace Halide;

template <typename T>
void show(const Buffer<T>& image) {
  for (int y = 0; y < image.height(); y++) {
    for (int x = 0; x < image.width(); x++) printf("%3d", (int)image(x, y));
    printf("\n");
  }
}

int main() {
  Var x("x"), y("y");
  {
    // A disk.
    Func disk("disk");
    RDom r(0, 9, 0, 7);
    r.where((r.x - 4) * (r.x - 4) + (r.y - 3) * (r.y - 3) <= 10);
    disk(x, y) = 0;
    disk(r.x, r.y) = r.x + r.y;
    show(Buffer<int>(disk.realize({9, 7})));
  }
  {
    // A triangle: two conditions that must both hold.
    Func triangle("triangle");
    RDom r(0, 8, 0, 8);
    r.where(r.x <= r.y);
    r.where(r.y < 6);
    triangle(x, y) = 0;
    triangle(r.x, r.y) += 1;
    Buffer<int> out = triangle.realize({8, 8});
    int sum = 0;
    out.for_each_value([&](int v) { sum += v; });
    printf("triangle: %d points\n", sum);
  }
  {
    // A condition that reads data.
    Buffer<uint8_t> image(16, 8);
    image.for_each_element([&](int i, int j) { image(i, j) = (uint8_t)((i * 13 + j * 29) % 64); });
    Func bright("bright");
    RDom r(image);
    r.where(image(r.x, r.y) > 48);
    bright() = Tuple(0, 0);
    bright() = Tuple(bright()[0] + 1, bright()[1] + cast<int>(image(r.x, r.y)));
    Realization both = bright.realize();
    Buffer<int> count = both[0], sum = both[1];
    printf("%d bright pixels, sum %d\n", count(), sum());
  }
  {
    // The condition may depend on pure variables, and the update can still be scheduled.
    Func prefix("prefix");
    RDom r(0, 32);
    r.where(r < x * 3);
    prefix(x) = 0;
    prefix(x) += r * r;
    Var xo("xo"), xi("xi");
    prefix.update().split(x, xo, xi, 4).vectorize(xi).parallel(xo);
    Buffer<int> out = prefix.realize({12});
    for (int i = 0; i < 12; i++) printf("%d ", out(i));
    printf("\n");
  }
  return 0;
}

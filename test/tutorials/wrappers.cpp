// Func::in: a wrapper between a producer and its consumers, with its own schedule.
#include "Halide.h"

#include <cstdio>

using namespace Halide;

static int stores;
int count(JITUserContext*, const halide_trace_event_t* event) {
  if (event->event == halide_trace_store) stores += event->type.lanes;
  return 0;
}

int checksum(const Buffer<int>& image) {
  int sum = 0;
  for (int y = 0; y < image.height(); y++) {
    for (int x = 0; x < image.width(); x++) sum += image(x, y) * (1 + x + 3 * y);
  }
  return sum;
}

int main() {
  Var x("x"), y("y"), xo("xo"), yo("yo"), xi("xi"), yi("yi");
  {
    // One consumer reads the wrapper; the other reads f.
    Func f("f"), g("g"), h("h"), both("both");
    f(x, y) = x * y + x;
    g(x, y) = f(x, y) + f(x + 1, y);
    h(x, y) = f(x, y) * 2;
    both(x, y) = g(x, y) - h(x, y);
    Func wrapper = f.in(g);
    f.compute_root();
    g.compute_root();
    h.compute_root();
    wrapper.compute_at(g, y).trace_stores();
    both.jit_handlers().custom_trace = count;
    stores = 0;
    Buffer<int> out = both.realize({8, 6});
    printf("one consumer: %d stores into the wrapper, checksum %d\n", stores, checksum(out));
    printf("a second call gives the same wrapper: %d\n", (int)(f.in(g).name() == wrapper.name()));
  }
  {
    // All consumers.
    Func f("f"), g("g"), h("h"), both("both");
    f(x, y) = x + 5 * y;
    g(x, y) = f(x, y) + 1;
    h(x, y) = f(x, y) + 2;
    both(x, y) = g(x, y) * h(x, y);
    f.in().compute_root().trace_stores();
    f.compute_root();
    g.compute_root();
    h.compute_root();
    both.jit_handlers().custom_trace = count;
    stores = 0;
    Buffer<int> out = both.realize({8, 6});
    printf("all consumers: %d stores into the wrapper, checksum %d\n", stores, checksum(out));
  }
  {
    // Staging: each tile of the input is copied to local storage before it is used.
    Buffer<int> image(40, 30);
    image.for_each_element([&](int i, int j) { image(i, j) = (i * 3 + j * 5) % 17; });
    ImageParam input(Int(32), 2, "input");
    input.set(image);
    Func clamped("clamped"), blur("blur");
    clamped(x, y) = input(clamp(x, 0, 39), clamp(y, 0, 29));
    blur(x, y) = clamped(x - 1, y) + clamped(x + 1, y) + clamped(x, y - 1) + clamped(x, y + 1);
    blur.tile(x, y, xo, yo, xi, yi, 16, 8);
    clamped.in(blur).compute_at(blur, xo).vectorize(x, 4);
    Buffer<int> out = blur.realize({40, 30});
    printf("staged tiles: checksum %d\n", checksum(out));
  }
  {
    // A wrapper of the output: the reduction stays in registers and is stored once.
    Func product("product");
    RDom k(0, 12);
    product(x, y) = 0;
    product(x, y) += (x + k) * (k - y);
    product.in().tile(x, y, xi, yi, 8, 4);
    product.compute_at(product.in(), x);
    Buffer<int> out = product.in().realize({16, 12});
    printf("output wrapper: checksum %d\n", checksum(out));
  }
  return 0;
}

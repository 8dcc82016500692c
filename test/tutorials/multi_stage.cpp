// Pipelines of several stages: compute and storage levels of producers, and how often each value is
// computed.
#include "Halide.h"

#include <cstdio>
#include <functional>

using namespace Halide;

static int evaluations;

int count(JITUserContext*, const halide_trace_event_t* event) {
  if (event->event == halide_trace_store) evaluations += event->type.lanes;
  return 0;
}

void run(const char* title, const std::function<void(Func, Func, Var, Var)>& schedule) {
  Func wave("wave"), edges("edges");
  Var x("x"), y("y");
  wave(x, y) = (x * 7 + y * 3) % 11;
  edges(x, y) = wave(x, y) + wave(x + 1, y) - wave(x, y + 1) - wave(x + 1, y + 1);
  schedule(wave, edges, x, y);
  wave.trace_stores();
  edges.jit_handlers().custom_trace = count;
  evaluations = 0;
  Buffer<int> result = edges.realize({16, 12});
  long sum = 0;
  for (int j = 0; j < 12; j++) {
    for (int i = 0; i < 16; i++) sum += result(i, j) * (i + 1) * (j + 2);
  }
  printf("%-22s wave stored %4d times, checksum %ld\n", title, evaluations, sum);
}

int main() {
  Var xo("xo"), yo("yo"), xi("xi"), yi("yi");
  // Inlined into its consumer: never stored.
  run("inline", [](Func, Func, Var, Var) {});
  // At root: all 17 x 13 points first.
  run("root", [](Func wave, Func, Var, Var) { wave.compute_root(); });
  // In each of the consumer's 12 rows: the two rows that it reads.
  run("at y", [](Func wave, Func edges, Var, Var y) { wave.compute_at(edges, y); });
  // Stored at root and computed per row: values of the previous row are still available (sliding
  // window).
  run("at y, stored at root",
      [](Func wave, Func edges, Var, Var y) { wave.store_root().compute_at(edges, y); });
  run("at x", [](Func wave, Func edges, Var x, Var) { wave.compute_at(edges, x); });
  run("at x, stored at y",
      [](Func wave, Func edges, Var x, Var y) { wave.store_at(edges, y).compute_at(edges, x); });
  // One tile at a time.
  run("tiled", [&](Func wave, Func edges, Var x, Var y) {
    edges.tile(x, y, xo, yo, xi, yi, 8, 4);
    wave.compute_at(edges, xo);
  });
  run("tiled and vectorized", [&](Func wave, Func edges, Var x, Var y) {
    edges.tile(x, y, xo, yo, xi, yi, 8, 4).vectorize(xi, 4).parallel(yo);
    wave.compute_at(edges, xo);
  });

  // A blur whose input is clamped to the image.
  Buffer<uint16_t> image(20, 10);
  image.for_each_element([&](int i, int j) { image(i, j) = (uint16_t)((i * 31 + j * 17) % 255); });
  Var x("x"), y("y");
  Func clamped = BoundaryConditions::repeat_edge(image);
  Func blur_x("blur_x"), blur_y("blur_y");
  blur_x(x, y) = (clamped(x - 1, y) + 2 * clamped(x, y) + clamped(x + 1, y)) / 4;
  blur_y(x, y) = (blur_x(x, y - 1) + 2 * blur_x(x, y) + blur_x(x, y + 1)) / 4;
  blur_x.compute_at(blur_y, y).vectorize(x, 8);
  blur_y.vectorize(x, 8).parallel(y);
  Buffer<uint16_t> blurred = blur_y.realize({20, 10});
  printf("blurred: %d %d %d %d\n", blurred(0, 0), blurred(19, 0), blurred(10, 5), blurred(19, 9));
  return 0;
}

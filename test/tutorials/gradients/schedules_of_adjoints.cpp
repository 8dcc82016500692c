// Schedules of adjoints.
//
// propagate_adjoints creates Funcs, so that compute_root, parallel, vectorize and compute_at work as for
// your own Funcs. The compiler schedules those that have no directives. A schedule never changes the
// values.
#include <retrograde/retrograde.h>

#include <chrono>
#include <cmath>

#include "tutorial.h"

using namespace retrograde;

const int size = 512;

struct Program {
  explicit Program(const Buffer<float>& image) {
    Var x("x"), y("y");
    RDom pixels(0, size, 0, size);
    edges(x, y) = image(x + 1, y) - image(x, y) + 0.5f * (image(x, y + 1) - image(x, y));
    soft(x, y) = edges(x, y) * edges(x, y) / (1.0f + edges(x, y) * edges(x, y));
    loss() = 0.0f;
    loss() += soft(pixels.x, pixels.y);
  }
  Func edges{"edges"}, soft{"soft"}, loss{"loss"};
};

double milliseconds(Func& f, Buffer<float>& result) {
  result = f.realize({size + 1, size + 1});  // compiles
  const auto start = std::chrono::steady_clock::now();
  for (int n = 0; n < 5; ++n) f.realize(result);
  const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - start;
  return spent.count() / 5;
}

double largest_difference(const Buffer<float>& a, const Buffer<float>& b) {
  double worst = 0;
  for (int y = 0; y <= size; ++y)
    for (int x = 0; x <= size; ++x) worst = std::max<double>(worst, std::abs(a(x, y) - b(x, y)));
  return worst;
}

int main(int argc, char** argv) {
  Buffer<float> image(size + 1, size + 1);
  for (int y = 0; y <= size; ++y)
    for (int x = 0; x <= size; ++x) image(x, y) = static_cast<float>((7 * x + x * y) % 29) / 16;
  Buffer<float> plain, chosen, by_hand;

  // ---- 1. The plainest schedule: everything at root, in serial loops. A directive on an adjoint turns off
  // the compiler's own schedule. ----
  Program first(image);
  Derivative d = propagate_adjoints(first.loss);
  Func slow = d(image);
  d(first.edges).compute_root();
  slow.compute_root();
  const double plain_ms = milliseconds(slow, plain);

  // ---- 2. No directives: the compiler computes Funcs that are read several times and are not cheap at
  // root, in parallel and vectorized. ----
  Program second(image);
  Func unscheduled = propagate_adjoints(second.loss)(image);
  const double chosen_ms = milliseconds(unscheduled, chosen);
  claim(largest_difference(plain, chosen) < 1e-5, "the compiler's schedule changes no value");

  // ---- 3. By hand: rows of the gradient in parallel and vectorized, and the adjoint of `edges` one strip
  // at a time, just before it is needed. The gradient's dimensions have names like those of any Func. ----
  Program third(image);
  Derivative e = propagate_adjoints(third.loss);
  Func gradient = e(image), edges_adj = e(third.edges);
  claim(gradient.args().size() == 2, "the gradient by an image has the image's dimensions");
  Var gx = gradient.args()[0], gy = gradient.args()[1], rows("rows");
  Var ex = edges_adj.args()[0];
  gradient.compute_root()
      .split(gy, rows, gy, 32, TailStrategy::GuardWithIf)
      .parallel(rows)
      .vectorize(gx, 8, TailStrategy::GuardWithIf);
  edges_adj.compute_at(gradient, rows).vectorize(ex, 8, TailStrategy::GuardWithIf);
  const double by_hand_ms = milliseconds(gradient, by_hand);
  claim(largest_difference(plain, by_hand) < 1e-5, "a schedule by hand changes no value either");

  // ---- funcs() returns all generated Funcs in the order in which they are computed, for inspection or
  // scheduling. ----
  claim(e.funcs().size() >= 3, "funcs() has the adjoints of soft, edges and the image");
  std::printf("plain %.2f ms, default %.2f ms, by hand %.2f ms\n", plain_ms, chosen_ms, by_hand_ms);

  Picture picture("Time of one gradient of 513 x 513 pixels; shorter is better");
  const double bars[] = {plain_ms, chosen_ms, by_hand_ms};
  const char* const names[] = {"compute_root", "default", "by hand"};
  const double longest = *std::max_element(bars, bars + 3);
  for (int n = 0; n < 3; ++n) {
    const int cells = std::max(1, static_cast<int>(20 * bars[n] / longest));
    picture.text(20, 74 + 50 * n, names[n]);
    picture.cells(120, 60 + 50 * n, 16, {std::vector<double>(cells, 1.0)}, 0, 1.5);
  }
  picture.write(argc, argv, "schedules_of_adjoints");
}

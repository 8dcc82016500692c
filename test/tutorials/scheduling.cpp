// Loop directives: the effect of each on the order of stores, recorded by a trace.
#include "Halide.h"

#include <cstdio>
#include <functional>
#include <vector>

using namespace Halide;

static std::vector<std::pair<int, int>> stored;

// Called for every store when a Func is traced.
int record(JITUserContext*, const halide_trace_event_t* event) {
  if (event->event == halide_trace_store) {
    for (int lane = 0; lane < event->type.lanes; lane++) {
      stored.push_back({event->coordinates[lane], event->coordinates[event->type.lanes + lane]});
    }
  }
  return 0;
}

void show(const char* title, const std::function<void(Func, Var, Var)>& schedule) {
  Func f("f");
  Var x("x"), y("y");
  f(x, y) = x + y;
  schedule(f, x, y);
  f.trace_stores();
  f.jit_handlers().custom_trace = record;
  stored.clear();
  Buffer<int> result = f.realize({6, 4});
  printf("%-10s", title);
  for (size_t i = 0; i < stored.size(); i++) {
    if (i < 14) printf(" %d%d", stored[i].first, stored[i].second);
  }
  printf("  (%zu stores)\n", stored.size());
  for (int y = 0; y < 4; y++) {
    for (int x = 0; x < 6; x++) {
      if (result(x, y) != x + y) printf("wrong at %d %d\n", x, y);
    }
  }
}

int main() {
  Var xo("xo"), yo("yo"), xi("xi"), yi("yi"), both("both"), tile("tile");
  show("default", [](Func, Var, Var) {});
  show("reorder", [](Func f, Var x, Var y) { f.reorder(y, x); });
  show("split", [&](Func f, Var x, Var) { f.split(x, xo, xi, 3); });
  show("fuse", [&](Func f, Var x, Var y) { f.fuse(x, y, both); });
  show("tile", [&](Func f, Var x, Var y) { f.tile(x, y, xo, yo, xi, yi, 3, 2); });
  show("vectorize", [&](Func f, Var x, Var) { f.split(x, xo, xi, 2).vectorize(xi); });
  show("unroll", [&](Func f, Var x, Var) { f.split(x, xo, xi, 2).unroll(xi); });
  show("columns", [&](Func f, Var x, Var y) { f.split(y, yo, yi, 2).reorder(yi, x, yo); });
  // 4 does not divide 6: the last block shifts inwards and recomputes two points.
  show("inwards", [&](Func f, Var x, Var) { f.split(x, xo, xi, 4); });
  show("guarded", [&](Func f, Var x, Var) { f.split(x, xo, xi, 4, TailStrategy::GuardWithIf); });
  show("nested", [&](Func f, Var x, Var y) {
    f.tile(x, y, xo, yo, xi, yi, 2, 2).fuse(xo, yo, tile).unroll(yi);
  });

  // The order of a parallel loop is unspecified, so only the result is shown.
  Func g("g");
  Var x("x"), y("y");
  g(x, y) = x * 100 + y;
  g.tile(x, y, xo, yo, xi, yi, 16, 8).fuse(xo, yo, tile).parallel(tile).vectorize(xi, 4);
  Buffer<int> result = g.realize({61, 35});
  long sum = 0;
  for (int y = 0; y < 35; y++) {
    for (int x = 0; x < 61; x++) sum += result(x, y);
  }
  printf("parallel: sum %ld\n", sum);
  return 0;
}

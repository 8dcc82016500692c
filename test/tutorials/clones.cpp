// Func::clone_in: a copy of a producer for some of its consumers, so that it can be computed in two
// ways.
#include "Halide.h"

#include <cstdio>

using namespace Halide;

static int stores;
int count(JITUserContext*, const halide_trace_event_t* event) {
  if (event->event == halide_trace_store) stores += event->type.lanes;
  return 0;
}

int main() {
  Var x("x"), y("y");
  {
    // f is inlined into h; its clone is computed at root for g.
    Func f("f"), g("g"), h("h"), both("both");
    f(x, y) = x * 3 + y;
    g(x, y) = f(x, y) + f(x - 1, y) + f(x, y - 1);
    h(x, y) = f(x, y) * f(x, y);
    both(x, y) = g(x, y) + h(x, y);
    Func copy = f.clone_in(g);
    copy.compute_root().trace_stores();
    g.compute_root();
    both.jit_handlers().custom_trace = count;
    stores = 0;
    Buffer<int> out = both.realize({10, 7});
    printf("%d stores into the copy, %d %d\n", stores, out(0, 0), out(9, 6));
  }
  {
    // A clone of a Func with an update, for several consumers.
    Func f("f"), a("a"), b("b"), c("c"), sum("sum");
    RDom r(0, 5);
    f(x) = x;
    f(x) += r * x;
    a(x) = f(x) + 1;
    b(x) = f(x) + 2;
    c(x) = f(x) + 3;
    sum(x) = a(x) + b(x) + c(x);
    Func copy = f.clone_in({a, b});
    f.compute_root();
    copy.compute_root().trace_stores();
    a.compute_root();
    b.compute_root();
    c.compute_root();
    sum.jit_handlers().custom_trace = count;
    stores = 0;
    Buffer<int> out = sum.realize({6});
    printf("%d stores into the copy:", stores);
    for (int i = 0; i < 6; i++) printf(" %d", out(i));
    printf("\n");
  }
  return 0;
}

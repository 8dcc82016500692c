// Debugging a pipeline: print, print_when, traces of stores, loop nests, lowered statements.
#include "Halide.h"

#include <cstdio>
#include <fstream>
#include <string>

using namespace Halide;

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : ".";
  Var x("x"), y("y");

  {
    // print() returns its first argument, and prints all arguments each time it is evaluated.
    Func squares("squares");
    squares(x) = print(x * x, "is the square of", x);
    squares.realize({4});
  }
  {
    // print_when() prints only where a condition holds.
    Func product("product");
    product(x, y) = print_when(x == 3 && y > 1, x * y, "<- product at", x, y);
    product.realize({5, 4});
  }
  {
    // print() of other types.
    Func mixed("mixed");
    mixed(x) = print(cast<float>(x) / 4, cast<uint8_t>(x + 250), cast<double>(x) / 8, x == 2);
    mixed.realize({3});
  }
  {
    // A trace reports every stored value.
    Func traced("traced");
    traced(x, y) = x + 10 * y;
    traced.trace_stores();
    traced.realize({3, 2});
  }
  {
    // The loops of a schedule, without running them.
    Func producer("producer"), consumer("consumer");
    producer(x, y) = x * y;
    consumer(x, y) = producer(x, y) + producer(x + 1, y);
    consumer.reorder(y, x).parallel(x);
    producer.compute_root().parallel(y);
    consumer.print_loop_nest();

    // The loops after splits and compute_at.
    Func rows("rows"), stencil("stencil");
    Var xo("xo"), xi("xi");
    rows(x, y) = x - y;
    stencil(x, y) = rows(x, y) + rows(x + 1, y);
    stencil.split(x, xo, xi, 4).vectorize(xi).unroll(y, 2);
    rows.compute_at(stencil, xo).vectorize(x, 4);
    stencil.print_loop_nest();
  }
  {
    // The lowered statement, just before code generation, as text and as HTML.
    Func lowered("lowered");
    lowered(x, y) = x + y;
    lowered.vectorize(x, 8).parallel(y);
    lowered.compile_to_lowered_stmt(folder + "/lowered.stmt", {}, Text);
    lowered.compile_to_lowered_stmt(folder + "/lowered.html", {}, HTML);
    for (const char* name : {"/lowered.stmt", "/lowered.html"}) {
      std::ifstream file(folder + name);
      std::string contents((std::istreambuf_iterator<char>(file)),
                           std::istreambuf_iterator<char>());
      printf("%s: names the Func: %d, and its parallel loop: %d\n", name + 1,
             (int)(contents.find("lowered") != std::string::npos),
             (int)(contents.find("parallel") != std::string::npos));
    }
  }
  {
    // An expression can be inspected without running it.
    Expr e = (x + 3) * y;
    printf("its type has %d bits\n", e.type().bits());
  }
  return 0;
}

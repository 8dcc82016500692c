// Tuples: several values per point.
#include "Halide.h"

#include <cstdio>

using namespace Halide;

// A fraction as a Tuple of two integers, with its own arithmetic.
struct Fraction {
  Expr over, under;
  Fraction(Expr numerator, Expr denominator) : over(numerator), under(denominator) {}
  Fraction(Tuple both) : over(both[0]), under(both[1]) {}
  Fraction(FuncRef at) : Fraction(Tuple(at)) {}
  operator Tuple() const { return Tuple(over, under); }
  Fraction operator+(const Fraction& other) const {
    return {over * other.under + other.over * under, under * other.under};
  }
  Fraction inverse() const { return {under, over}; }
  Expr operator<(const Fraction& other) const { return over * other.under < other.over * under; }
};

int main() {
  Var x("x"), y("y");
  {
    // A Realization holds one Buffer for each value.
    Func both("both");
    both(x, y) = Tuple(x + y, sin(cast<float>(x * y)));
    Realization r = both.realize({4, 3});
    Buffer<int> sums = r[0];
    Buffer<float> sines = r[1];
    printf("%d buffers: %d %.4f\n", (int)r.size(), sums(3, 2), sines(3, 2));

    // Another definition can read a single value of the Tuple.
    Func scaled("scaled");
    scaled(x, y) = both(x, y)[1] * both(x, y)[0];
    Buffer<float> out = scaled.realize({4, 3});
    printf("%.4f\n", out(2, 1));
  }
  {
    // Results written to existing Buffers.
    Func pair("pair");
    pair(x) = {x * 2, cast<uint8_t>(x + 1)};
    Buffer<int> first(5);
    Buffer<uint8_t> second(5);
    pair.realize({first, second});
    printf("%d %d, outputs %d\n", first(4), second(4), pair.outputs());
  }
  {
    // The position of the largest value: by hand and with argmax.
    Func source("source"), largest("largest");
    source(x) = (x * 29) % 97;
    RDom r(1, 63);
    largest() = Tuple(0, source(0));
    Expr better = source(r) > largest()[1];
    largest() = Tuple(select(better, r, largest()[0]), select(better, source(r), largest()[1]));
    Realization at = largest.realize();
    Buffer<int> place = at[0], value = at[1];
    Tuple named = argmax(source(RDom(0, 64)));
    printf("largest: %d at %d", value(), place());
    int named_place = evaluate<int>(named[0]), named_value = evaluate<int>(named[1]);
    printf(", by name %d at %d\n", named_value, named_place);
  }
  {
    // A user-defined type: the golden ratio by its continued fraction 1 + 1 / (1 + 1 / (1 + ...)).
    Func convergent("convergent");
    RDom next(1, 11);
    convergent(x) = Fraction(1, 1);
    convergent(next) = Fraction(convergent(next - 1)).inverse() + Fraction(1, 1);
    Realization found = convergent.realize({12});
    Buffer<int> over = found[0], under = found[1];
    for (int i = 0; i < 12; i++) printf("%d/%d ", over(i), under(i));

    // The first convergent above 1.6 and below 1.62.
    RDom all(0, 12);
    Fraction candidate = convergent(all);
    Expr is_near = Fraction(8, 5) < candidate && candidate < Fraction(81, 50);
    convergent.compute_root();
    printf("- number %d\n", evaluate<int>(argmax(cast<int>(is_near))[0]));
  }
  {
    // Euclid's algorithm: pairs (a, b) become (b, a % b) until b is 0. The program counts the steps.
    Func pair("pair"), steps("steps");
    Var step("step");
    RDom later(1, 7);
    pair(x, y, step) = Tuple(x + 1, y + 1);
    Expr a = pair(x, y, later - 1)[0], b = pair(x, y, later - 1)[1];
    pair(x, y, later) = Tuple(select(b == 0, a, b), select(b == 0, 0, a % max(b, 1)));
    RDom any(0, 8);
    steps(x, y) = argmin(any, cast<int>(pair(x, y, any)[1] != 0))[0];
    pair.compute_root();
    Buffer<int> out = steps.realize({40, 16});
    for (int j = 0; j < 16; j++) {
      for (int i = 0; i < 40; i++) putchar(" .:+*#@%"[out(i, j)]);
      putchar('\n');
    }
  }
  return 0;
}

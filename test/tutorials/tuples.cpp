// Several values at each point.
#include "Halide.h"

#include <cstdio>

using namespace Halide;

// A complex number as a Tuple of two Exprs, with its own arithmetic.
struct Complex {
  Expr re, im;
  Complex(Expr re, Expr im) : re(re), im(im) {}
  Complex(Tuple t) : re(t[0]), im(t[1]) {}
  Complex(FuncRef t) : Complex(Tuple(t)) {}
  operator Tuple() const { return Tuple(re, im); }
  Complex operator+(const Complex& o) const { return {re + o.re, im + o.im}; }
  Complex operator*(const Complex& o) const {
    return {re * o.re - im * o.im, re * o.im + im * o.re};
  }
  Expr magnitude_squared() const { return re * re + im * im; }
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

    // One of its values, in another definition.
    Func scaled("scaled");
    scaled(x, y) = both(x, y)[1] * both(x, y)[0];
    Buffer<float> out = scaled.realize({4, 3});
    printf("%.4f\n", out(2, 1));
  }
  {
    // Into buffers of one's own.
    Func pair("pair");
    pair(x) = {x * 2, cast<uint8_t>(x + 1)};
    Buffer<int> first(5);
    Buffer<uint8_t> second(5);
    pair.realize({first, second});
    printf("%d %d, outputs %d\n", first(4), second(4), pair.outputs());
  }
  {
    // The place of the largest value, by hand and by name.
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
    // Iterations of z * z + c until it leaves a circle.
    Func escape("escape"), steps("steps");
    Var z("z");
    Complex c(x / 10.0f - 1.5f, y / 6.0f - 1.0f);
    RDom t(1, 20);
    escape(x, y, z) = Complex(0.0f, 0.0f);
    Complex before = escape(x, y, t - 1);
    escape(x, y, t) = before * before + c;
    Expr inside = Complex(escape(x, y, t)).magnitude_squared() < 4.0f;
    steps(x, y) = argmin(t, cast<int>(inside))[0];
    Buffer<int> out = steps.realize({24, 12});
    const char* shades = " .:-=+*#%@ABCDEFGHIJ";
    for (int j = 0; j < 12; j++) {
      for (int i = 0; i < 24; i++) putchar(shades[out(i, j)]);
      putchar('\n');
    }
  }
  return 0;
}

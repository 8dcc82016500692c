// Smooth functions, their fast forms, kinks and jumps, branches that are NaN where not taken.
#include "gradient/adversary/maker.h"

namespace retrograde::gradient {

Expr Maker::smooth(const Type& type, const Point& at, int depth) {
  const Expr a = value(type, at, depth - 1);
  auto one = [&](double v) { return cast(type, Expr(v)); };
  switch (c_.below(15)) {
    case 0:
      return sin(a);
    case 1:
      return a - value(type, at, depth - 1);
    case 2:
      return a / (one(1.5) + cos(value(type, at, depth - 1)));
    case 3:
      return exp(-(a * a));
    case 4:
      return tanh(a);
    case 5:
      return atan2(a, value(type, at, depth - 1));
    case 6:
      return hypot(a, value(type, at, depth - 1));
    case 7:
      return lerp(a, value(type, at, depth - 1), value(type, at, depth - 1));
    case 8:
      return log(one(1.5) + a * a);
    case 9:
      return sqrt(a * a + one(0.5));
    case 10:
      return pow(one(1) + a * a, value(type, at, depth - 1));
    case 11:
      return pow(a, c_.between(0, 3));
    case 12:
      return one(1) / (one(1) + exp(-a));
    case 13:
      return erf(a);
    default:
      return -a;
  }
}

// The same with less exact functions, which the interpreter takes for the exact ones in double.
Expr Maker::fast(const Type& type, const Point& at, int depth) {
  const Expr a = converted(Float(32), value(type, at, depth - 1));
  switch (c_.below(7)) {
    case 0:
      return converted(type, fast_exp(-(a * a)));
    case 1:
      return converted(type, fast_log(a * a + 1.5f));
    case 2:
      return converted(type, fast_pow(a * a + 1.0f, converted(Float(32), leaf(type, at))));
    case 3:
      return converted(type, fast_sin(a));
    case 4:
      return converted(type, fast_cos(a));
    case 5:
      return converted(type, fast_inverse(a * a + 0.5f));
    default:
      return converted(type, fast_inverse_sqrt(a * a + 0.5f));
  }
}

// Kinks and jumps.
Expr Maker::broken(const Type& type, const Point& at, int depth) {
  const Expr a = value(type, at, depth - 1);
  switch (c_.below(12)) {
    case 0:
      return max(a, value(type, at, depth - 1));
    case 1:
      return min(a, value(type, at, depth - 1));
    case 2:
      return max(a, a);
    case 3:
      return abs(a - constant(type));
    case 4:
      return clamp(a, constant(type), converted(type, Expr(1.0f)));
    case 5:
      return converted(type, cast<int>(clamp(a, converted(type, Expr(-9.0f)),
                                             converted(type, Expr(9.0f))) *
                                       3)) *
             leaf(type, at);
    case 6:
      return a - floor(a);
    case 7:
      return a % converted(type, Expr(0.75f));
    case 8:
      return converted(type, cast(Float(c_.chance(50) ? 64 : 16), a));
    case 9:
      return absd(a, value(type, at, depth - 1));
    case 10:
      return select(a > leaf(type, at), a, value(type, at, depth - 1));
    default:
      return a + converted(type, cast<uint8_t>(clamp(a, converted(type, Expr(0.0f)),
                                                     converted(type, Expr(9.0f)))));
  }
}

// Branches that are NaN or infinite where they are not taken, or are chosen by place.
Expr Maker::guarded(const Type& type, const Point& at, int depth) {
  const Expr a = value(type, at, depth - 1);
  auto one = [&](double v) { return cast(type, Expr(v)); };
  switch (c_.below(9)) {
    case 0:
      return select(places_.condition(at.all), a, value(type, at, depth - 1));
    case 1:
      return select(a > one(0.75), sqrt(a - one(0.75)), a);
    case 2:
      return select(a > one(0), log(a), a * one(2));
    case 3:
      return select(abs(a) < one(0.125), one(1), sin(a) / a);
    case 4:
      return select(a < one(1), acos(a) * one(0), a * a);
    case 5:
      return select(a == one(0), one(0), one(1) / a);
    case 6:
      return sqrt(max(a, one(0)));
    case 7:
      return mux(places_.by_data(coordinate(at, 0), 3), {a, leaf(type, at), constant(type)});
    default:
      return select(places_.condition(at.all) && a > one(0.5), a * a, pow(a, one(0.5)));
  }
}

}  // namespace retrograde::gradient

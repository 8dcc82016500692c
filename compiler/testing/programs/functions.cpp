// Smooth functions, their fast forms, kinks and jumps, branches that are NaN where not taken.
#include "testing/programs/maker.h"

namespace retrograde::fuzz {

Expr Maker::smooth(const Type& type, const Point& at, int depth) {
  const Expr a = value(type, at, depth - 1);
  auto one = [&](double v) { return cast(type, Expr(v)); };
  return c_.one_of<Expr>({
      [&] { return sin(a); },
      [&] { return a - value(type, at, depth - 1); },
      [&] { return a / (one(1.5) + cos(value(type, at, depth - 1))); },
      [&] { return exp(-(a * a)); },
      [&] { return tanh(a); },
      [&] { return atan2(a, value(type, at, depth - 1)); },
      [&] { return hypot(a, value(type, at, depth - 1)); },
      [&] { return lerp(a, value(type, at, depth - 1), value(type, at, depth - 1)); },
      [&] { return log(one(1.5) + a * a); },
      [&] { return sqrt(a * a + one(0.5)); },
      [&] { return pow(one(1) + a * a, value(type, at, depth - 1)); },
      [&] { return pow(a, c_.between(0, 3)); },
      [&] { return one(1) / (one(1) + exp(-a)); },
      [&] { return erf(a); },
      [&] { return -a; },
  });
}

// The same with the fast functions, which the interpreter evaluates exactly in double.
Expr Maker::fast(const Type& type, const Point& at, int depth) {
  const Expr a = converted(Float(32), value(type, at, depth - 1));
  return c_.one_of<Expr>({
      [&] { return converted(type, fast_exp(-(a * a))); },
      [&] { return converted(type, fast_log(a * a + 1.5f)); },
      [&] { return converted(type, fast_pow(a * a + 1.0f, converted(Float(32), leaf(type, at)))); },
      [&] { return converted(type, fast_sin(a)); },
      [&] { return converted(type, fast_cos(a)); },
      [&] { return converted(type, fast_inverse(a * a + 0.5f)); },
      [&] { return converted(type, fast_inverse_sqrt(a * a + 0.5f)); },
  });
}

// Kinks and jumps.
Expr Maker::broken(const Type& type, const Point& at, int depth) {
  const Expr a = value(type, at, depth - 1);
  return c_.one_of<Expr>({
      [&] { return max(a, value(type, at, depth - 1)); },
      [&] { return min(a, value(type, at, depth - 1)); },
      [&] { return max(a, a); },
      [&] { return abs(a - constant(type)); },
      [&] { return clamp(a, constant(type), converted(type, Expr(1.0f))); },
      [&] {
        return converted(type, cast<int>(clamp(a, converted(type, Expr(-9.0f)),
                                               converted(type, Expr(9.0f))) *
                                         3)) *
               leaf(type, at);
      },
      [&] { return a - floor(a); },
      [&] { return a % converted(type, Expr(0.75f)); },
      [&] { return converted(type, cast(Float(c_.chance(50) ? 64 : 16), a)); },
      [&] { return absd(a, value(type, at, depth - 1)); },
      [&] { return select(a > leaf(type, at), a, value(type, at, depth - 1)); },
      [&] {
        return a + converted(type, cast<uint8_t>(clamp(a, converted(type, Expr(0.0f)),
                                                       converted(type, Expr(9.0f)))));
      },
  });
}

// Branches that are NaN or infinite where they are not taken, or that are selected by coordinates.
Expr Maker::guarded(const Type& type, const Point& at, int depth) {
  const Expr a = value(type, at, depth - 1);
  auto one = [&](double v) { return cast(type, Expr(v)); };
  return c_.one_of<Expr>({
      [&] { return select(place_condition(at.all), a, value(type, at, depth - 1)); },
      [&] { return select(a > one(0.75), sqrt(a - one(0.75)), a); },
      [&] { return select(a > one(0), log(a), a * one(2)); },
      [&] { return select(abs(a) < one(0.125), one(1), sin(a) / a); },
      [&] { return select(a < one(1), acos(a) * one(0), a * a); },
      [&] { return select(a == one(0), one(0), one(1) / a); },
      [&] { return sqrt(max(a, one(0))); },
      [&] {
        return mux(by_data(coordinate(at, 0), 3), {a, leaf(type, at), constant(type)});
      },
      [&] { return select(place_condition(at.all) && a > one(0.5), a * a, pow(a, one(0.5))); },
  });
}

}  // namespace retrograde::fuzz

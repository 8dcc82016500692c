// Expressions: leaves, arithmetic, integers.
#include "gradient/adversary/maker.h"

namespace retrograde::gradient {

Expr converted(const Type& type, const Expr& e) {
  if (e.type() == type) return e;
  if (e.type().is_float() && !type.is_float())
    return cast(type, clamp(e, type.is_uint() ? 0.0f : -100.0f, 100.0f));
  return cast(type, e);
}

float Maker::weight() { return static_cast<float>(c_.around_zero(6)) / 8.0f + 0.0625f; }

Expr Maker::constant(const Type& type) { return converted(type, Expr(0.5f + weight())); }

Expr Maker::leaf(const Type& type, const Point& at) {
  if (at.in_update() && c_.chance(35)) return converted(type, read_self(at));
  switch (c_.below(8)) {
    case 0:
      return constant(type);
    case 1:
    case 2:
    case 3:
      return converted(type, read_image(at));
    case 4:
      return converted(type, p_.scale);
    case 5:  // by a Param: where inversion fixes the coordinate, functions of it alone would be
             // folded in float32, which the checks in double take for an error
      return at.all.empty() ? constant(type)
                            : converted(type, cast<float>(coordinate(at, 0)) * p_.scale * 0.125f);
    default:
      return converted(type, read_func(at));
  }
}

// Functions of bfloat16 are float32.
Expr Maker::value(const Type& type, const Point& at, int depth) {
  if (depth <= 0 || --budget_ < 0) return leaf(type, at);
  if (!type.is_float()) return integer(type, at, depth);
  switch (c_.below(12)) {
    case 0:
    case 1:
      return leaf(type, at);
    case 2:
      return value(type, at, depth - 1) + value(type, at, depth - 1);
    case 3:
      return value(type, at, depth - 1) * converted(type, weight());
    case 4:
      return value(type, at, depth - 1) * value(type, at, depth - 1);
    case 5:
    case 6:
      return converted(type, smooth(type, at, depth));
    case 7:
      return converted(type, broken(type, at, depth));
    case 8:
      return converted(type, guarded(type, at, depth));
    case 9:
      return reduced(type, at, depth);
    case 10:
      return fast(type, at, depth);
    default:
      return converted(type, ruled(type, at, depth));
  }
}

Expr Maker::integer(const Type& type, const Point& at, int depth) {
  if (type.is_bool()) return value(Float(32), at, depth - 1) > 0.75f;
  switch (c_.below(3)) {
    case 0:
      return converted(type, places_.by_data(coordinate(at, 0), natural_size));
    case 1:
      return converted(type, value(Float(32), at, depth - 1) * 4.0f);
    default:
      return converted(type, select(places_.condition(at.all), 1, 3));
  }
}

}  // namespace retrograde::gradient

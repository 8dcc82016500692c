// Expressions: leaves, conversions between all types, operators on integers and bools. Wide values stay far from
// overflow: Funcs hold small values, factors are smaller still; narrow integers wrap.
#include "testing/programs/maker.h"

namespace retrograde::fuzz {

bool is_wide(const Type& type) { return type.is_int_or_uint() && type.bits() >= 32; }

Expr converted(const Type& type, const Expr& e) {
  const Type from = e.type();
  if (from == type) return e;
  if (type.is_bool()) return e > cast(from, Expr(0.5f));
  if (from.is_float() && !type.is_float())
    return cast(type, clamp(e, type.is_uint() ? 0.0f : -100.0f, 100.0f));
  if (from.is_int() && type.is_uint() && is_wide(type)) return cast(type, max(e, cast(from, 0)));
  return cast(type, e);
}

Expr sum_of(const Expr& a, const Expr& b) { return a.type().is_bool() ? a || b : a + b; }

Expr Maker::kept_small(const Expr& value, int modulus) const {
  if (!s_.has_integers) return value;
  const Type type = value.type();
  if (is_wide(type)) return value % cast(type, modulus);
  return type.is_float() ? clamp(value, cast(type, -100.0f), cast(type, 100.0f)) : value;
}

Expr Maker::condition(const Point& at, int depth) {
  if (depth > 1 && c_.chance(30)) {
    const Expr a = condition(at, depth - 1), b = condition(at, depth - 1);
    return c_.chance(50) ? a && b : a || b;
  }
  if (c_.chance(15)) return !condition(at, depth - 1);
  if (c_.chance(20)) return place_condition(at.all);
  const Type type = c_.pick(s_.image_types);
  const Expr a = value(type, at, depth - 1), b = value(type, at, depth - 1);
  return c_.one_of<Expr>({
      [&] { return a < b; },
      [&] { return a <= b; },
      [&] { return a == b; },
  });
}

// An operand so small that products of two do not overflow.
Expr Maker::factor(const Type& type, const Point& at, int depth) {
  const Expr a = value(type, at, depth);
  return is_wide(type) ? a % cast(type, 61) : a;
}

Expr Maker::arithmetic(const Type& type, const Point& at, int depth) {
  if (c_.chance(12)) return leaf(type, at);
  if (type.is_bool()) return condition(at, depth);
  if (c_.chance(12)) {
    const Expr a = value(type, at, depth - 1);
    return select(condition(at, depth - 1), a, value(type, at, depth - 1));
  }
  if (c_.chance(10)) return converted(type, value(c_.pick(s_.image_types), at, depth - 1));
  if (at.may_reduce && c_.chance(8)) return reduced(type, at, depth);
  return operation(type, at, depth);
}

Expr Maker::operation(const Type& type, const Point& at, int depth) {
  const auto operand = [&] { return value(type, at, depth - 1); };
  const auto sum = [&] { return operand() + operand(); };
  // Unsigned wide differences must not wrap through zero.
  const auto difference = [&] {
    return type.is_uint() && is_wide(type) ? max(operand(), operand()) : operand() - operand();
  };
  const auto product = [&] { return factor(type, at, depth - 1) * factor(type, at, depth - 1); };
  const auto quotient = [&] {
    const int by = c_.between(1, 9), sign = type.is_int() && c_.chance(20) ? -1 : 1;
    const Expr divisor = c_.chance(40) ? operand() : cast(type, sign * by);
    return c_.chance(50) ? operand() / divisor : operand() % divisor;
  };
  // The results of abs and absd are unsigned.
  const auto distance = [&] {
    const Type from = c_.chance(50) ? type.with_code(TypeCode::Int) : type;
    const Expr a = value(type.is_float() ? type : from, at, depth - 1);
    if (c_.chance(50)) return converted(type, absd(a, value(a.type(), at, depth - 1)));
    return converted(type, from.is_int() ? abs(a) : a);
  };
  const auto saturated = [&] {
    if (type.is_float()) return sum();
    return saturating_cast(type, value(c_.pick(s_.image_types), at, depth - 1));
  };
  const auto mixed = [&] {
    if (!type.is_uint() || is_wide(type)) return min(operand(), operand());
    return lerp(operand(), operand(), value(UInt(8), at, depth - 1));
  };
  return c_.one_of<Expr>({sum, sum, sum, difference, difference, product, product, quotient,
                          quotient, [&] { return min(operand(), operand()); },
                          [&] { return max(operand(), operand()); }, distance, saturated, mixed,
                          [&] { return type.is_float() ? sum() : bits(type, at, depth); }});
}

Expr Maker::bits(const Type& type, const Point& at, int depth) {
  const Expr a = value(type, at, depth - 1);
  const Expr amount = cast(type, c_.between(0, is_wide(type) ? 3 : type.bits() - 1));
  const bool fits = !is_wide(type);
  return c_.one_of<Expr>({
      [&] { return a & value(type, at, depth - 1); },
      [&] { return a << amount; },
      [&] { return a >> amount; },
      [&] { return fits ? a | value(type, at, depth - 1) : a << amount; },
      [&] { return fits ? a ^ value(type, at, depth - 1) : a >> amount; },
  });
}

float Maker::weight() { return static_cast<float>(c_.around_zero(6)) / 8.0f + 0.0625f; }

Expr Maker::constant(const Type& type) {
  if (!s_.has_integers) return converted(type, Expr(0.5f + weight()));
  return converted(type,
                   type.is_float() ? Expr(c_.around_zero(100) / 8.0f) : Expr(c_.around_zero(100)));
}

Expr Maker::parameter() {
  if (!s_.has_integers) return p_.scale;
  return c_.pick(std::vector<Expr>{p_.scale, p_.count, p_.narrow});
}

Expr Maker::leaf(const Type& type, const Point& at) {
  if (at.in_update() && c_.chance(s_.self_reads)) return converted(type, read_self(at));
  return c_.one_of<Expr>({
      [&] { return constant(type); },
      [&] { return converted(type, read_image(at)); },
      [&] { return converted(type, read_image(at)); },
      [&] { return converted(type, read_image(at)); },
      [&] { return converted(type, parameter()); },
      // Scaled by a Param. Where inversion fixes the coordinate, functions of it alone would be folded in float32,
      // which the checks in double would report as an error.
      [&] {
        if (s_.has_integers && !at.all.empty()) return converted(type, coordinate(at, 0));
        return at.all.empty() ? constant(type)
                              : converted(type, cast<float>(coordinate(at, 0)) * p_.scale * 0.125f);
      },
      [&] { return converted(type, read_func(at)); },
      [&] { return converted(type, read_func(at)); },
  });
}

// Functions of bfloat16 return float32.
Expr Maker::value(const Type& type, const Point& at, int depth) {
  if (depth <= 0 || --budget_ < 0) return leaf(type, at);
  if (s_.has_integers && (!type.is_float() || c_.chance(92))) return arithmetic(type, at, depth);
  if (!type.is_float()) return integer(type, at, depth);
  const auto operand = [&] { return value(type, at, depth - 1); };
  return converted(type,
                   c_.one_of<Expr>({
                       [&] { return leaf(type, at); },
                       [&] { return leaf(type, at); },
                       [&] { return operand() + operand(); },
                       [&] { return operand() * converted(type, weight()); },
                       [&] { return operand() * operand(); },
                       [&] { return smooth(type, at, depth); },
                       [&] { return smooth(type, at, depth); },
                       [&] { return broken(type, at, depth); },
                       [&] { return guarded(type, at, depth); },
                       [&] { return at.may_reduce ? reduced(type, at, depth) : leaf(type, at); },
                       [&] { return s_.has_rules ? fast(type, at, depth) : leaf(type, at); },
                       [&] { return s_.has_rules ? ruled(type, at, depth) : leaf(type, at); },
                   }));
}

Expr Maker::integer(const Type& type, const Point& at, int depth) {
  if (type.is_bool()) return value(Float(32), at, depth - 1) > 0.75f;
  return c_.one_of<Expr>({
      [&] { return converted(type, by_data(coordinate(at, 0), natural_size)); },
      [&] { return converted(type, value(Float(32), at, depth - 1) * 4.0f); },
      [&] { return converted(type, select(place_condition(at.all), 1, 3)); },
  });
}

}  // namespace retrograde::fuzz

#include "analysis/interval_arithmetic.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/interval_ends.h"
#include "analysis/linear.h"
#include "ir/build.h"
#include "ir/scalar.h"

namespace retrograde::analysis {

namespace {

Wide wide_floor_div(Wide a, Wide b) { return a / b - (a % b < 0); }

// The hull of the four combinations of ends.
template <class F>
Interval combine_corners(Type type, const WidePair& a, const WidePair& b, F f) {
  std::array<Wide, 4> corners = {f(a.min, b.min), f(a.min, b.max), f(a.max, b.min),
                                 f(a.max, b.max)};
  auto [min, max] = std::minmax_element(corners.begin(), corners.end());
  return wide_interval(type, *min, *max);
}

// For constant ends.
Interval float_corners(Kind kind, const Interval& a, const Interval& b) {
  Interval result;
  for (const Expr& x : {a.min, a.max}) {
    for (const Expr& y : {b.min, b.max}) {
      Expr corner = binary(kind, x, y);
      if (!float_end(corner)) return Interval::everything();
      result.min = result.min.defined() ? binary(Kind::Min, result.min, corner) : corner;
      result.max = result.max.defined() ? binary(Kind::Max, result.max, corner) : corner;
    }
  }
  return result;
}

// v * factor or v / factor for a factor with one value: monotonic, and rounding of floats preserves
// that.
Interval scaled(Kind kind, const Interval& v, const Expr& factor) {
  const Interval result{end_op(kind, v.min, factor), end_op(kind, v.max, factor)};
  if (const auto c = as_scalar(factor)) {
    const double number = c->as_double();
    if (number == 0 && !c->type.is_float()) return Interval::point(make_zero(factor.type()));
    if (number == 0 || !std::isfinite(number)) return Interval::everything();
    return number > 0 ? result : Interval{result.max, result.min};
  }
  if (!result.is_bounded()) return Interval::everything();
  return {canonical_min(result.min, result.max), canonical_max(result.min, result.max)};
}

}  // namespace

Interval type_range(Type type) {
  type = type.element_of();
  if (type.is_uint() && type.bits() >= 32) return {make_zero(type), {}};
  if (!type.is_int_or_uint() || type.bits() >= 32) return Interval::everything();
  if (type.is_uint()) return {make_zero(type), make_uint_const(type, type.max_uint())};
  return {make_const(type, type.min_int()), make_const(type, type.max_int())};
}

Interval constant_interval(Type type, int64_t min, int64_t max) {
  return wide_interval(type.element_of(), min, max);
}

std::optional<int64_t> constant_min(const Interval& v) {
  return v.min.defined() ? as_const_int(v.min) : std::nullopt;
}
std::optional<int64_t> constant_max(const Interval& v) {
  return v.max.defined() ? as_const_int(v.max) : std::nullopt;
}
bool is_nonnegative(const Interval& v) {
  auto min = wide_end(v.min);
  return min && *min >= 0;
}

Interval interval_add(Type type, const Interval& a, const Interval& b) {
  if (type.is_float() || has_linear_form(type)) {
    return without_nan({end_op(Kind::Add, a.min, b.min), end_op(Kind::Add, a.max, b.max)});
  }
  auto x = wide_ends(a), y = wide_ends(b);
  return x && y ? wide_interval(type, x->min + y->min, x->max + y->max) : type_range(type);
}

Interval interval_sub(Type type, const Interval& a, const Interval& b) {
  if (type.is_float() || has_linear_form(type)) {
    return without_nan({end_op(Kind::Sub, a.min, b.max), end_op(Kind::Sub, a.max, b.min)});
  }
  auto x = wide_ends(a), y = wide_ends(b);
  return x && y ? wide_interval(type, x->min - y->max, x->max - y->min) : type_range(type);
}

Interval interval_mul(Type type, const Interval& a, const Interval& b) {
  if (type.is_float()) {
    if (float_ends(a) && float_ends(b)) return float_corners(Kind::Mul, a, b);
    if (b.is_point()) return scaled(Kind::Mul, a, b.min);
    return a.is_point() ? scaled(Kind::Mul, b, a.min) : Interval::everything();
  }
  auto x = wide_ends(a), y = wide_ends(b);
  if (x && y) return combine_corners(type, *x, *y, [](Wide p, Wide q) { return p * q; });
  if (!has_linear_form(type)) return type_range(type);
  if (b.is_point()) return scaled(Kind::Mul, a, b.min);
  if (a.is_point()) return scaled(Kind::Mul, b, a.min);
  if (is_nonnegative(a) && is_nonnegative(b)) {
    return {end_op(Kind::Mul, a.min, b.min), end_op(Kind::Mul, a.max, b.max)};
  }
  if (!a.is_bounded() || !b.is_bounded()) return Interval::everything();
  return hull(scaled(Kind::Mul, a, b.min), scaled(Kind::Mul, a, b.max));
}

// Rounded once, so it is monotonic in the product and in c: the extremes lie at corners of a and b.
Interval interval_fma(const Interval& a, const Interval& b, const Interval& c) {
  if (!a.is_bounded() || !b.is_bounded() || !c.is_bounded()) return Interval::everything();
  const auto ends = [](const Interval& v) {
    return v.is_point() ? std::vector<Expr>{v.min} : std::vector<Expr>{v.min, v.max};
  };
  Interval result;
  for (const Expr& x : ends(a)) {
    for (const Expr& y : ends(b)) {
      Expr low = call_op(Op::fma, {x, y, c.min}), high = call_op(Op::fma, {x, y, c.max});
      for (const Expr& corner : {low, high}) {
        const auto number = as_const_float(corner);
        if (number && !std::isfinite(*number)) return Interval::everything();
      }
      result.min = result.min.defined() ? canonical_min(result.min, low) : low;
      result.max = result.max.defined() ? canonical_max(result.max, high) : high;
    }
  }
  return result;
}

Interval interval_div(Type type, const Interval& a, const Interval& b) {
  if (type.is_float()) {
    auto divisor = float_ends(b);
    if (divisor && divisor->min <= 0 && divisor->max >= 0) return Interval::everything();
    if (divisor && float_ends(a)) return float_corners(Kind::Div, a, b);
    return b.is_point() ? scaled(Kind::Div, a, b.min) : Interval::everything();
  }
  auto low = wide_end(b.min), high = wide_end(b.max);
  if (low && high && *low == *high &&
      *low != 0) {  // one constant: monotonic, decreasing when it is negative
    Interval q{end_op(Kind::Div, a.min, b.min), end_op(Kind::Div, a.max, b.min)};
    return *low > 0 ? q : Interval{q.max, q.min};
  }
  auto x = wide_ends(a);
  if (x && low && high && *low > 0) {
    return combine_corners(type, *x, {*low, *high},
                           [](Wide p, Wide q) { return wide_floor_div(p, q); });
  }
  if (is_nonnegative(a) && low && *low > 0) {
    Expr min = high ? end_op(Kind::Div, a.min, b.max) : make_zero(type);
    return {min, end_op(Kind::Div, a.max, b.min)};
  }
  if (type.is_uint()) return {make_zero(type), a.max};
  if (!a.is_bounded()) return type_range(type);
  // a / b| <= |a| for any b; but -128 / -1 of a narrow type wraps.
  if (!has_linear_form(type)) return type_range(type);
  return {canonical_min(a.min, negate(a.max)), canonical_max(a.max, negate(a.min))};
}

namespace {

// a % c for a constant c > 0: exact when a stays within one period.
Interval remainder_of(Type type, const Interval& a, int64_t c) {
  Interval period{make_zero(type), make_const(type, c - 1)};
  if (auto x = wide_ends(a)) {
    bool one_period = wide_floor_div(x->min, c) == wide_floor_div(x->max, c);
    Wide start = wide_floor_div(x->min, c) * c;
    return one_period ? wide_interval(type, x->min - start, x->max - start) : period;
  }
  if (!has_linear_form(type) || !a.is_bounded()) return period;
  // min == c*q + r and max == c*q + s with constants 0 <= r <= s < c
  Expr r = canonical(binary(Kind::Mod, a.min, make_const(type, c)));
  auto distance = constant_difference(a.max, a.min);
  auto rest = as_const_int(r);
  if (!distance || !rest || *distance < 0 || *rest + *distance >= c) return period;
  return constant_interval(type, *rest, *rest + *distance);
}

}  // namespace

Interval interval_mod(Type type, const Interval& a, const Interval& b) {
  if (type.is_float()) {
    auto divisor = float_ends(b);
    if (!divisor || divisor->min <= 0 || !float_ends(a)) return Interval::everything();
    return {make_zero(type), b.max};
  }
  auto low = constant_min(b), high = constant_max(b);
  if (low && high && *low == *high && *low > 0) return remainder_of(type, a, *low);
  Expr zero = make_zero(type);
  if (type.is_uint()) return {zero, b.max};
  if (low && *low > 0) return {zero, end_op(Kind::Sub, b.max, make_one(type))};
  if (!b.is_bounded() || !has_linear_form(type)) return {zero, type_range(type).max};
  Expr largest = canonical_max(b.max, negate(b.min));  // of |b|
  return {zero, canonical_max(zero, canonical(binary(Kind::Sub, largest, make_one(type))))};
}

namespace {

bool may_be_nan(Type type, const Interval& v) {
  return type.is_float() && !v.min.defined() && !v.max.defined();
}

Type end_type(const Interval& v) { return v.min.defined() ? v.min.type() : v.max.type(); }

Expr both(Kind kind, const Expr& a, const Expr& b) {
  if (!a.defined() || !b.defined()) return {};
  return kind == Kind::Min ? canonical_min(a, b) : canonical_max(a, b);
}
Expr either(Kind kind, const Expr& a, const Expr& b) {
  if (!a.defined()) return b;
  if (!b.defined()) return a;
  return both(kind, a, b);
}

// min and max propagate only a NaN in their second operand.
bool loses_bounds(const Interval& b) { return !b.min.defined() && !b.max.defined(); }

}  // namespace

Interval interval_min(const Interval& a, const Interval& b) {
  if (loses_bounds(b)) {  // an integer a still bounds the result
    return a.max.defined() && !may_be_nan(end_type(a), b) ? Interval{{}, a.max}
                                                          : Interval::everything();
  }
  return {both(Kind::Min, a.min, b.min), either(Kind::Min, a.max, b.max)};
}

Interval interval_max(const Interval& a, const Interval& b) {
  if (loses_bounds(b)) {
    return a.min.defined() && !may_be_nan(end_type(a), b) ? Interval{a.min, {}}
                                                          : Interval::everything();
  }
  return {either(Kind::Max, a.min, b.min), both(Kind::Max, a.max, b.max)};
}

Interval interval_clamp(const Interval& v, const Interval& low, const Interval& high) {
  return interval_max(interval_min(v, high), low);
}

Interval interval_between(const Interval& v, const Interval& low, const Interval& high) {
  return {interval_max(v, low).min, interval_min(v, high).max};
}

namespace {

Interval cast_ends(Type to, const Interval& v) {
  return {v.min.defined() ? canonical(cast_to(to, v.min)) : Expr(),
          v.max.defined() ? canonical(cast_to(to, v.max)) : Expr()};
}

Interval float_to_int(Type to, const Interval& v) {
  if (!v.min.defined() && !v.max.defined()) return type_range(to);
  auto end = [&](const Expr& e) -> Expr {  // truncation never decreases
    if (!e.defined()) return {};
    auto value = as_const_float(e);
    if (!value) return has_linear_form(to) ? cast_to(to, e) : Expr();
    double truncated = std::trunc(*value);
    return std::isfinite(truncated) && to.can_represent(truncated) ? cast_to(to, e) : Expr();
  };
  // Conversion of a value beyond the type is undefined, so one unbounded end makes both unknown.
  Interval ends{end(v.min), end(v.max)};
  return ends.is_bounded() ? ends : type_range(to);
}

Interval int_to_int(Type to, Type from, const Interval& v) {
  if (to.can_represent(from)) return cast_ends(to, v);
  auto min = wide_end(v.min), max = wide_end(v.max);
  if (min && max) return wide_interval(to, *min, *max);
  if (has_linear_form(to)) {  // does not overflow; a constant end that would is dropped
    auto fits = [&](const Expr& e, const std::optional<Wide>& c) {
      return e.defined() && (!c || wide_const(to, *c).defined());
    };
    return cast_ends(to, {fits(v.min, min) ? v.min : Expr(), fits(v.max, max) ? v.max : Expr()});
  }
  bool grows = to.bits() >= 32 && to.bits() >= from.bits() && is_nonnegative(v);
  return grows ? cast_ends(to, v) : type_range(to);
}

}  // namespace

Interval interval_cast(Type to, Type from, const Interval& v) {
  if (to == from) return v;
  if (to.is_float()) return cast_ends(to, v);
  if (!to.is_int_or_uint()) return Interval::everything();
  if (from.is_float()) return to.is_bool() ? type_range(to) : float_to_int(to, v);
  if (!from.is_int_or_uint() || to.is_bool()) return type_range(to);
  return int_to_int(to, from, v);
}

Interval interval_abs(Type result, Type operand, const Interval& v) {
  if (operand.is_float()) {
    auto ends = float_ends(v);
    if (!ends && v.is_bounded()) return {make_zero(result), canonical_max(v.max, negate(v.min))};
    if (!ends)
      return may_be_nan(operand, v) ? Interval::everything() : Interval{make_zero(result), {}};
    double largest = std::max(std::abs(ends->min), std::abs(ends->max));
    double least =
        ends->min <= 0 && ends->max >= 0 ? 0 : std::min(std::abs(ends->min), std::abs(ends->max));
    return {make_const(result, least), make_const(result, largest)};
  }
  if (auto x = wide_ends(v)) {
    Wide low = x->min < 0 ? -x->min : x->min, high = x->max < 0 ? -x->max : x->max;
    bool crosses = x->min <= 0 && x->max >= 0;
    return wide_interval(result, crosses ? 0 : std::min(low, high), std::max(low, high));
  }
  if (!has_linear_form(operand) || !v.is_bounded()) return type_range(result);
  if (is_nonnegative(v)) return cast_ends(result, v);
  return {make_zero(result), cast_to(result, canonical_max(v.max, negate(v.min)))};
}

Interval interval_absd(Type result, Type operand, const Interval& a, const Interval& b) {
  if (operand.is_float()) return interval_abs(result, operand, interval_sub(operand, a, b));
  auto x = wide_ends(a), y = wide_ends(b);
  if (!x || !y) {
    if (!has_linear_form(operand)) return type_range(result);
    return interval_abs(result, operand, interval_sub(operand, a, b));
  }
  Wide least = std::max<Wide>({0, x->min - y->max, y->min - x->max});
  return wide_interval(result, least, std::max(x->max - y->min, y->max - x->min));
}

Interval interval_bitwise(Op op, Type type, const Interval& a, const Interval& b) {
  if (type.is_bool()) return type_range(type);
  auto x = wide_ends(a), y = wide_ends(b);
  bool a_positive = is_nonnegative(a), b_positive = is_nonnegative(b);
  Expr zero = make_zero(type);
  if (op == Op::bitwise_and) {  // at most either operand that is not negative
    if (a_positive && b_positive) return {zero, either(Kind::Min, a.max, b.max)};
    if (a_positive) return {zero, a.max};
    if (b_positive) return {zero, b.max};
    return type_range(type);
  }
  if (!x || !y || !a_positive || !b_positive) return type_range(type);
  Wide bits = 1;
  while (bits <= std::max(x->max, y->max)) bits *= 2;
  Wide least = op == Op::bitwise_or ? std::max(x->min, y->min) : 0;
  return wide_interval(type, least, bits - 1);
}

Interval interval_shift(Op op, Type type, const Interval& a, const Interval& amount) {
  auto low = constant_min(amount), high = constant_max(amount);
  bool is_fixed = low && high && *low == *high && *low >= 0 && *low < type.bits() && *low < 62;
  if (!is_fixed) {
    if (op == Op::shift_left && type.is_int() && low && high && *low >= 0 &&
        *high < std::min(type.bits() - 1, 62)) {
      return interval_mul(
          type, a, {make_const(type, int64_t{1} << *low), make_const(type, int64_t{1} << *high)});
    }
    // Shifting by a fixed amount is increasing, in either direction.
    if (amount.is_point() && !low && a.is_bounded() && type.is_int() && type.bits() >= 32)
      return {call_op(op, type, {a.min, amount.min}), call_op(op, type, {a.max, amount.max})};
    bool shrinks = op == Op::shift_right && low && *low >= 0 && is_nonnegative(a);
    return shrinks ? Interval{make_zero(type), a.max} : type_range(type);
  }
  if (type.is_uint() ? *low >= type.bits() : *low >= type.bits() - 1) return type_range(type);
  Interval factor = Interval::point(make_const(type, int64_t{1} << *low));
  return op == Op::shift_left ? interval_mul(type, a, factor) : interval_div(type, a, factor);
}

Interval interval_monotone(Op op, Type type, const Interval& v) {
  auto end = [&](const Expr& e) {
    const bool is_itself = !e.defined() || (op == Op::strict_float && is_const(e));
    return is_itself ? e : call_op(op, type, {e});
  };
  return without_nan({end(v.min), end(v.max)});
}

}  // namespace retrograde::analysis

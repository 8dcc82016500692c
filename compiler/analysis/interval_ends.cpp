#include "analysis/interval_ends.h"

#include <cmath>

#include "analysis/interval_arithmetic.h"
#include "analysis/linear.h"
#include "ir/build.h"
#include "ir/scalar.h"

namespace retrograde::analysis {

std::optional<Wide> wide_end(const Expr& end) {
  if (!end.defined()) return std::nullopt;
  auto s = as_scalar(end);
  if (!s || !s->type.is_int_or_uint()) return std::nullopt;
  return s->type.is_uint() ? static_cast<Wide>(s->u) : static_cast<Wide>(s->i);
}

std::optional<WidePair> wide_ends(const Interval& v) {
  auto min = wide_end(v.min), max = wide_end(v.max);
  if (min && max) return WidePair{*min, *max};
  return std::nullopt;
}

Expr wide_const(Type type, Wide value) {
  if (type.is_uint()) {
    if (value < 0 || value > static_cast<Wide>(type.max_uint())) return {};
    return make_uint_const(type, static_cast<uint64_t>(value));
  }
  if (value < type.min_int() || value > type.max_int()) return {};
  return make_const(type, static_cast<int64_t>(value));
}

Interval wide_interval(Type type, Wide min, Wide max) {
  Interval v{wide_const(type, min), wide_const(type, max)};
  if (has_linear_form(type)) return v;  // does not overflow, so each end holds by itself
  return v.is_bounded() ? v : type_range(type);
}

std::optional<double> float_end(const Expr& end) {
  auto value = end.defined() ? as_const_float(end) : std::nullopt;
  return value && !std::isnan(*value) ? value : std::nullopt;
}

std::optional<DoublePair> float_ends(const Interval& v) {
  auto min = float_end(v.min), max = float_end(v.max);
  if (!min || !max || !std::isfinite(*min) || !std::isfinite(*max)) return std::nullopt;
  return DoublePair{*min, *max};
}

namespace {

bool is_nan_end(const Expr& end) {
  auto value = end.defined() ? as_const_float(end) : std::nullopt;
  return value && std::isnan(*value);
}

}  // namespace

Interval without_nan(const Interval& v) {
  return is_nan_end(v.min) || is_nan_end(v.max) ? Interval::everything() : v;
}

Expr end_op(Kind kind, const Expr& a, const Expr& b) {
  return a.defined() && b.defined() ? canonical(binary(kind, a, b)) : Expr();
}

Expr negate(const Expr& e) {
  return e.defined() ? canonical(binary(Kind::Sub, make_zero(e.type()), e)) : e;
}

}  // namespace retrograde::analysis

// What the operators of operators.def do to scalars. Floats narrower than 64 bits are computed in
// double and rounded once, so these are the exact functions that vector math approximates.
#include <algorithm>
#include <bit>
#include <cmath>

#include "diagnostics/error.h"
#include "ir/scalar.h"

namespace retrograde::ir {

namespace {

using Args = std::vector<Scalar>;

uint64_t magnitude(const Scalar& a) {
  if (a.type.is_uint() || a.i >= 0) return a.u;
  return -a.u;
}

Scalar shift(const Scalar& a, int64_t left) {
  const Type type = a.type;
  if (left >= type.bits()) return Scalar::of_int(type, 0);
  if (left >= 0) return Scalar::of_uint(type, a.u << left);
  if (left <= -type.bits()) return Scalar::of_int(type, type.is_int() && a.i < 0 ? -1 : 0);
  return type.is_int() ? Scalar::of_int(type, a.i >> -left) : Scalar::of_uint(type, a.u >> -left);
}

// An unsigned amount beyond int64 shifts everything out, like any amount of at least the width.
int64_t shift_amount(const Scalar& b) {
  constexpr int64_t far = 128;
  if (b.type.is_uint()) return b.u > static_cast<uint64_t>(far) ? far : static_cast<int64_t>(b.u);
  return b.i > far ? far : b.i < -far ? -far : b.i;
}

Scalar eval_bitwise(Op op, const Scalar& a, const Scalar& b) {
  const uint64_t bits = op == Op::bitwise_and  ? a.u & b.u
                        : op == Op::bitwise_or ? a.u | b.u
                                               : a.u ^ b.u;
  return Scalar::of_uint(a.type, bits);
}

Scalar eval_absd(const Scalar& a, const Scalar& b, Type type) {
  if (a.type.is_float()) return Scalar::of_float(type, std::fabs(a.f - b.f));
  const bool less = a.type.is_int() ? a.i < b.i : a.u < b.u;
  return Scalar::of_uint(type, less ? b.u - a.u : a.u - b.u);
}

// ---- lerp ----

double unit_weight(const Scalar& weight) {
  if (weight.type.is_float()) return weight.f;
  return static_cast<double>(weight.u) / static_cast<double>(weight.type.max_uint());
}

// A weight is first brought to the width of the values, rounding down: 0.5 of 8 bits is 127 / 255.
// The product is one of floats, so that the weight k / 65535.0f is k. (A narrower one is the same
// fraction of its own range and can stay.)
Scalar fixed_point_weight(const Scalar& weight, Type values) {
  const Type fixed = UInt(values.bits());
  if (weight.type.is_float()) {
    const Type product = weight.type.bits() > 32 || values.bits() > 16 ? Float(64) : Float(32);
    return eval_cast(fixed,
                     Scalar::of_float(product, weight.f * static_cast<double>(fixed.max_uint())));
  }
  if (weight.type.bits() <= values.bits()) return weight;
  return Scalar::of_uint(fixed, weight.u / (weight.type.max_uint() / fixed.max_uint()));
}

// Nearest integer to a + (b - a) * w / max_w. max_w is odd, so there are no ties.
Scalar lerp_integers(const Scalar& a, const Scalar& b, const Scalar& weight) {
  using Wide = __int128;
  const auto widen = [](const Scalar& s) { return s.type.is_int() ? Wide{s.i} : Wide{s.u}; };
  const Wide max = Wide{weight.type.max_uint()};
  const Wide w = Wide{weight.u};
  if (a.type.bits() >= 64) return w * 2 > max ? b : a;  // not reached: build rejects 64-bit lerps
  const Wide sum = widen(a) * (max - w) + widen(b) * w;
  const Wide half = max / 2;
  const Wide rounded = sum >= 0 ? (sum + half) / max : -((-sum + half) / max);
  return Scalar::of_int(a.type, static_cast<int64_t>(rounded));
}

Scalar eval_lerp(const Scalar& a, const Scalar& b, const Scalar& weight, Type type) {
  if (a.type.is_float()) {
    const double w = unit_weight(weight);
    return Scalar::of_float(type, a.f * (1 - w) + b.f * w);
  }
  if (a.type.is_bool()) return unit_weight(weight) > 0.5 ? b : a;
  return lerp_integers(a, b, fixed_point_weight(weight, a.type));
}

// ---- others ----

Scalar eval_saturating_cast(Type type, const Scalar& a) {
  if (type == a.type) return a;
  if (type == Float(16)) {
    if (std::isnan(a.as_double())) return eval_cast(type, a);
    const double largest = 65504;
    return Scalar::of_float(type, std::clamp(a.as_double(), -largest, largest));
  }
  if (type.is_float()) return eval_cast(type, a);    // the ends of its range are infinities
  if (a.type.is_float()) return eval_cast(type, a);  // saturates already
  if (a.type.is_int() ? type.can_represent(a.i) : type.can_represent(a.u))
    return eval_cast(type, a);
  const bool negative = a.type.is_int() && a.i < 0;
  return negative ? Scalar::of_int(type, type.min_int()) : Scalar::of_uint(type, type.max_uint());
}

Scalar eval_count(Op op, const Scalar& a) {
  const int bits = a.type.bits();
  const uint64_t value = bits >= 64 ? a.u : a.u & (~uint64_t{0} >> (64 - bits));
  int count = 0;
  if (op == Op::popcount) {
    count = std::popcount(value);
  } else if (op == Op::count_leading_zeros) {
    count = std::countl_zero(value) - (64 - bits);
  } else {
    count = value ? std::countr_zero(value) : bits;
  }
  return Scalar::of_int(a.type, count);
}

double eval_unary_float(Op op, double x) {
  switch (op) {
    case Op::floor:
      return std::floor(x);
    case Op::ceil:
      return std::ceil(x);
    case Op::round:
      return std::nearbyint(x);
    case Op::trunc:
      return std::trunc(x);
    case Op::sqrt:
      return std::sqrt(x);
    case Op::exp:
    case Op::fast_exp:
      return std::exp(x);
    case Op::log:
    case Op::fast_log:
      return std::log(x);
    case Op::sin:
    case Op::fast_sin:
      return std::sin(x);
    case Op::cos:
    case Op::fast_cos:
      return std::cos(x);
    case Op::tan:
      return std::tan(x);
    case Op::asin:
      return std::asin(x);
    case Op::acos:
      return std::acos(x);
    case Op::atan:
      return std::atan(x);
    case Op::sinh:
      return std::sinh(x);
    case Op::cosh:
      return std::cosh(x);
    case Op::tanh:
      return std::tanh(x);
    case Op::asinh:
      return std::asinh(x);
    case Op::acosh:
      return std::acosh(x);
    case Op::atanh:
      return std::atanh(x);
    case Op::erf:
      return std::erf(x);
    case Op::fast_inverse:
      return 1 / x;
    case Op::fast_inverse_sqrt:
      return 1 / std::sqrt(x);
    default:
      internal_error(text("no scalar meaning for operator ", op_info(op).name));
  }
}

Scalar eval_unary(Op op, const Scalar& a, Type type) {
  switch (op) {
    case Op::bitwise_not:
      return Scalar::of_uint(a.type, ~a.u);
    case Op::abs:
      return a.type.is_float() ? Scalar::of_float(type, std::fabs(a.f))
                               : Scalar::of_uint(type, magnitude(a));
    case Op::is_nan:
      return Scalar::of_bool(std::isnan(a.f));
    case Op::is_inf:
      return Scalar::of_bool(std::isinf(a.f));
    case Op::is_finite:
      return Scalar::of_bool(std::isfinite(a.f));
    case Op::popcount:
    case Op::count_leading_zeros:
    case Op::count_trailing_zeros:
      return eval_count(op, a);
    case Op::saturating_cast:
      return eval_saturating_cast(type, a);
    default:
      return Scalar::of_float(type, eval_unary_float(op, a.f));
  }
}

Scalar eval_two(Op op, const Scalar& a, const Scalar& b, Type type) {
  switch (op) {
    case Op::shift_left:
      return shift(a, shift_amount(b));
    case Op::shift_right:
      return shift(a, -shift_amount(b));
    case Op::absd:
      return eval_absd(a, b, type);
    case Op::pow:
    case Op::fast_pow:
      return Scalar::of_float(type, std::pow(a.f, b.f));
    case Op::hypot:
      return Scalar::of_float(type, std::hypot(a.f, b.f));
    case Op::atan2:
      return Scalar::of_float(type, std::atan2(a.f, b.f));
    case Op::strong_mul:
      return Scalar::of_float(type, a.f == 0 ? 0.0 : a.f * b.f);
    case Op::strong_div:
      return Scalar::of_float(type, a.f == 0 ? 0.0 : a.f / b.f);
    default:
      return eval_bitwise(op, a, b);
  }
}

}  // namespace

std::optional<Scalar> eval_operator(Op op, const Args& args, Type type) {
  const OpInfo& info = op_info(op);
  if (info.cls == OpClass::Marker) return args.at(0);
  if (info.cls != OpClass::Pure) return std::nullopt;
  RETROGRADE_ASSERT(static_cast<int>(args.size()) == info.arity, info.name, " of ", args.size(),
                    " arguments");
  const Type scalar = type.element_of();
  if (info.arity == 1) return eval_unary(op, args[0], scalar);
  if (info.arity == 2) return eval_two(op, args[0], args[1], scalar);
  return eval_lerp(args[0], args[1], args[2], scalar);
}

}  // namespace retrograde::ir

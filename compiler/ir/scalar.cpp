// Arithmetic, comparison and conversion of scalars.
#include "ir/scalar.h"

#include <bit>
#include <cmath>

#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::ir {

int64_t wrap_int(int bits, int64_t value) {
  if (bits >= 64) return value;
  return static_cast<int64_t>(static_cast<uint64_t>(value) << (64 - bits)) >> (64 - bits);
}

int64_t euclidean_div(int64_t a, int64_t b) {
  if (b == 0) return 0;
  if (b == -1) return static_cast<int64_t>(-static_cast<uint64_t>(a));
  const int64_t quotient = a / b;
  if (a % b >= 0) return quotient;
  return b > 0 ? quotient - 1 : quotient + 1;
}

int64_t euclidean_mod(int64_t a, int64_t b) {
  if (b == 0 || b == -1) return 0;
  const int64_t remainder = a % b;
  if (remainder >= 0) return remainder;
  return static_cast<int64_t>(static_cast<uint64_t>(remainder) +
                              (b > 0 ? static_cast<uint64_t>(b) : -static_cast<uint64_t>(b)));
}

namespace {

// Wraps modulo 2^64 first: signed overflow in C++ is undefined.
uint64_t wrap_uint(int bits, uint64_t value) {
  return bits >= 64 ? value : value & (~uint64_t{0} >> (64 - bits));
}

Scalar of_pattern(Type type, uint64_t bits) {
  return type.is_int() ? Scalar::of_int(type, static_cast<int64_t>(bits))
                       : Scalar::of_uint(type, bits);
}

// Operations that depend only on the order of the operands.
template <class T>
Scalar by_order(Kind kind, const Scalar& a, const Scalar& b, T Scalar::*number) {
  const T x = a.*number, y = b.*number;
  switch (kind) {
    case Kind::Min:
      return x < y ? a : b;
    case Kind::Max:
      return x > y ? a : b;
    case Kind::EQ:
      return Scalar::of_bool(x == y);
    case Kind::NE:
      return Scalar::of_bool(x != y);
    case Kind::LT:
      return Scalar::of_bool(x < y);
    case Kind::LE:
      return Scalar::of_bool(x <= y);
    case Kind::GT:
      return Scalar::of_bool(x > y);
    case Kind::GE:
      return Scalar::of_bool(x >= y);
    default:
      internal_error(text(kind_name(kind), " of scalars"));
  }
}

Scalar integer_binary(Kind kind, const Scalar& a, const Scalar& b) {
  const bool is_int = a.type.is_int();
  const auto bits = [&](uint64_t value) { return of_pattern(a.type, value); };
  switch (kind) {
    case Kind::Add:
      return bits(a.u + b.u);
    case Kind::Sub:
      return bits(a.u - b.u);
    case Kind::Mul:
      return bits(a.u * b.u);
    case Kind::Div:
      if (is_int) return Scalar::of_int(a.type, euclidean_div(a.i, b.i));
      return bits(b.u ? a.u / b.u : 0);
    case Kind::Mod:
      if (is_int) return Scalar::of_int(a.type, euclidean_mod(a.i, b.i));
      return bits(b.u ? a.u % b.u : 0);
    case Kind::And:
      return bits(a.u & b.u);
    case Kind::Or:
      return bits(a.u | b.u);
    default:
      return is_int ? by_order(kind, a, b, &Scalar::i) : by_order(kind, a, b, &Scalar::u);
  }
}

// Computing + - * / in double and rounding once gives the correctly rounded result of the narrower
// type (53 >= 2 p + 2). Modulus rounds at each step, as machine code in the narrower type does.
Scalar float_binary(Kind kind, const Scalar& a, const Scalar& b) {
  const auto round = [&](double value) { return Scalar::of_float(a.type, value); };
  switch (kind) {
    case Kind::Add:
      return round(a.f + b.f);
    case Kind::Sub:
      return round(a.f - b.f);
    case Kind::Mul:
      return round(a.f * b.f);
    case Kind::Div:
      return round(a.f / b.f);
    case Kind::Mod: {
      const Scalar multiple = round(b.f * std::floor(round(a.f / b.f).f));
      return round(a.f - multiple.f);
    }
    default:
      return by_order(kind, a, b, &Scalar::f);
  }
}

// The IR leaves out-of-range conversions unspecified; here they saturate, and NaN gives 0.
Scalar float_to_integer(Type type, double value) {
  if (std::isnan(value)) return of_pattern(type, 0);
  const double limit = std::ldexp(1.0, type.is_int() ? type.bits() - 1 : type.bits());
  if (value >= limit) return of_pattern(type, type.max_uint());
  if (value <= (type.is_int() ? -limit : -1.0)) return Scalar::of_int(type, type.min_int());
  if (type.is_int()) return Scalar::of_int(type, static_cast<int64_t>(value));
  return Scalar::of_uint(type, static_cast<uint64_t>(std::trunc(value)));
}

// A 64-bit integer converted to double and then to float32 would round twice.
double integer_to_float(Type type, const Scalar& value) {
  if (type.bits() == 32 && type.code() == TypeCode::Float) {
    return value.type.is_int() ? static_cast<float>(value.i) : static_cast<float>(value.u);
  }
  return value.as_double();
}

uint64_t bit_pattern(const Scalar& value) {
  const Type type = value.type;
  if (type.is_int_or_uint() || type.is_handle()) return wrap_uint(type.bits(), value.u);
  if (type.bits() == 64) return std::bit_cast<uint64_t>(value.f);
  if (type.bits() == 32) return std::bit_cast<uint32_t>(static_cast<float>(value.f));
  return type.is_bfloat() ? bfloat16_t(value.f).to_bits() : float16_t(value.f).to_bits();
}

}  // namespace

double round_to_type(Type type, double value) {
  if (type.is_bfloat()) return static_cast<double>(bfloat16_t(value));
  if (type.bits() == 32) return static_cast<double>(static_cast<float>(value));
  return type.bits() == 16 ? static_cast<double>(float16_t(value)) : value;
}

Scalar Scalar::of_int(Type type, int64_t value) {
  Scalar result;
  result.type = type.element_of();
  if (type.is_int()) {
    result.i = wrap_int(type.bits(), value);
  } else {
    result.u = wrap_uint(type.bits(), static_cast<uint64_t>(value));
  }
  return result;
}

Scalar Scalar::of_uint(Type type, uint64_t value) {
  return of_int(type, static_cast<int64_t>(value));
}

Scalar Scalar::of_float(Type type, double value) {
  Scalar result;
  result.type = type.element_of();
  result.f = round_to_type(type, value);
  return result;
}

Scalar eval_binary(Kind kind, const Scalar& a, const Scalar& b) {
  RETROGRADE_ASSERT(a.type == b.type, kind_name(kind), " of ", to_string(a.type), " and ",
                    to_string(b.type));
  return a.type.is_float() ? float_binary(kind, a, b) : integer_binary(kind, a, b);
}

Scalar eval_not(const Scalar& a) { return Scalar::of_bool(!a.as_bool()); }

Scalar eval_cast(Type type, const Scalar& value) {
  if (type.is_float()) {
    if (value.type.is_float()) return Scalar::of_float(type, value.f);
    return Scalar::of_float(type, integer_to_float(type, value));
  }
  if (type.is_bool())
    return Scalar::of_uint(type, value.type.is_float() ? value.f != 0 : value.u != 0);
  return value.type.is_float() ? float_to_integer(type, value.f) : of_pattern(type, value.u);
}

Scalar eval_reinterpret(Type type, const Scalar& value) {
  const uint64_t bits = bit_pattern(value);
  if (!type.is_float()) return of_pattern(type, bits);
  if (type.bits() == 64) return Scalar::of_float(type, std::bit_cast<double>(bits));
  if (type.bits() == 32)
    return Scalar::of_float(type, std::bit_cast<float>(static_cast<uint32_t>(bits)));
  const auto half = static_cast<uint16_t>(bits);
  return Scalar::of_float(type, type.is_bfloat()
                                    ? static_cast<double>(bfloat16_t::make_from_bits(half))
                                    : static_cast<double>(float16_t::make_from_bits(half)));
}

std::optional<Scalar> as_scalar(const Expr& e) {
  if (!e.defined()) return std::nullopt;
  if (const auto* imm = e.as<IntImm>()) return Scalar::of_int(imm->type, imm->value);
  if (const auto* imm = e.as<UIntImm>()) return Scalar::of_uint(imm->type, imm->value);
  if (const auto* imm = e.as<FloatImm>()) return Scalar::of_float(imm->type, imm->value);
  if (const auto* splat = e.as<Broadcast>()) return as_scalar(splat->value);
  return std::nullopt;
}

Expr to_expr(const Scalar& value) {
  if (value.type.is_float()) return make_const(value.type, value.f);
  return value.type.is_int() ? make_const(value.type, value.i)
                             : make_uint_const(value.type, value.u);
}

}  // namespace retrograde::ir

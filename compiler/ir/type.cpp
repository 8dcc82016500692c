// Value ranges and names of types, and the 16-bit float formats.
#include "ir/type.h"

#include <cmath>

namespace retrograde {

namespace {

// A 16-bit binary interchange format: sign, exponent, fraction.
struct FloatFormat {
  int exponent_bits, fraction_bits;
  int bias() const { return (1 << (exponent_bits - 1)) - 1; }
  int min_exponent() const { return 1 - bias(); }
  int infinity() const { return ((1 << exponent_bits) - 1) << fraction_bits; }
};
constexpr FloatFormat half_format{5, 10};
constexpr FloatFormat brain_format{8, 7};

// Rounds once, to nearest even, for any distance between the formats. Relies on the default
// rounding mode.
uint16_t encode(const FloatFormat& format, double value) {
  const int sign = std::signbit(value) ? 0x8000 : 0;
  if (std::isnan(value)) return sign | format.infinity() | 1 << (format.fraction_bits - 1);
  if (std::isinf(value)) return sign | format.infinity();
  if (value == 0) return sign;
  int exponent;
  std::frexp(value, &exponent);
  exponent -= 1;  // value in [2^exponent, 2^(exponent + 1))
  if (exponent > format.bias()) return sign | format.infinity();
  const int clamped = std::max(exponent, format.min_exponent());
  const int steps = static_cast<int>(
      std::nearbyint(std::ldexp(std::fabs(value), format.fraction_bits - clamped)));
  // Denormals have the biased exponent 0 and no hidden bit. A carry out of the fraction moves into
  // the exponent, which correctly rounds up to the next power of two, to the first normal, or to
  // infinity.
  const int biased = exponent < format.min_exponent() ? 0 : clamped + format.bias() - 1;
  return sign | ((biased << format.fraction_bits) + steps);
}

double decode(const FloatFormat& format, uint16_t bits) {
  const double sign = bits & 0x8000 ? -1.0 : 1.0;
  const int magnitude = bits & 0x7fff;
  const int fraction = magnitude & ((1 << format.fraction_bits) - 1);
  const int biased = magnitude >> format.fraction_bits;
  if (magnitude > format.infinity())
    return std::copysign(std::numeric_limits<double>::quiet_NaN(), sign);
  if (magnitude == format.infinity()) return sign * std::numeric_limits<double>::infinity();
  if (biased == 0) return sign * std::ldexp(fraction, format.min_exponent() - format.fraction_bits);
  return sign * std::ldexp(fraction | 1 << format.fraction_bits,
                           biased - format.bias() - format.fraction_bits);
}

double largest_finite(Type type) {
  if (type.is_bfloat()) return decode(brain_format, brain_format.infinity() - 1);
  if (type.bits() == 16) return decode(half_format, half_format.infinity() - 1);
  if (type.bits() == 32) return std::numeric_limits<float>::max();
  return std::numeric_limits<double>::max();
}

int significant_bits(Type type) {
  if (type.is_bfloat()) return brain_format.fraction_bits + 1;
  return type.bits() == 16 ? half_format.fraction_bits + 1 : type.bits() == 32 ? 24 : 53;
}

}  // namespace

float16_t::float16_t(double value) { bits = encode(half_format, value); }
float16_t::float16_t(float value) : float16_t(static_cast<double>(value)) {}
float16_t::operator float() const { return static_cast<float>(decode(half_format, bits)); }
bfloat16_t::bfloat16_t(double value) { bits = encode(brain_format, value); }
bfloat16_t::bfloat16_t(float value) : bfloat16_t(static_cast<double>(value)) {}
bfloat16_t::operator float() const { return static_cast<float>(decode(brain_format, bits)); }

int64_t Type::min_int() const {
  if (!is_int()) return 0;
  return std::numeric_limits<int64_t>::min() >> (64 - bits_);
}

int64_t Type::max_int() const {
  if (is_int()) return std::numeric_limits<int64_t>::max() >> (64 - bits_);
  return bits_ >= 64 ? std::numeric_limits<int64_t>::max() : static_cast<int64_t>(max_uint());
}

uint64_t Type::max_uint() const {
  if (is_int()) return static_cast<uint64_t>(max_int());
  return bits_ == 0 ? 0 : ~uint64_t{0} >> (64 - bits_);
}

bool Type::can_represent(int64_t value) const {
  if (is_int()) return value >= min_int() && value <= max_int();
  if (is_uint()) return value >= 0 && static_cast<uint64_t>(value) <= max_uint();
  return is_float() && std::fabs(static_cast<double>(value)) <= largest_finite(*this);
}

bool Type::can_represent(uint64_t value) const {
  if (is_int_or_uint()) return value <= max_uint();
  return is_float() && static_cast<double>(value) <= largest_finite(*this);
}

bool Type::can_represent(double value) const {
  if (is_float()) return !std::isfinite(value) || std::fabs(value) <= largest_finite(*this);
  if (!is_int_or_uint() || value != std::trunc(value)) return false;
  const double limit = std::ldexp(1.0, is_int() ? bits_ - 1 : bits_);
  return value < limit && value >= (is_int() ? -limit : 0.0);
}

bool Type::can_represent(Type other) const {
  if (other.lanes() != lanes()) return false;
  if (code() == other.code() && bits() >= other.bits()) return true;
  if (is_float() && other.is_float()) {
    return significant_bits(*this) >= significant_bits(other) &&
           largest_finite(*this) >= largest_finite(other);
  }
  if (is_float() && other.is_int_or_uint()) {
    return other.bits() - (other.is_int() ? 1 : 0) <= significant_bits(*this) &&
           can_represent(other.max_uint());
  }
  return is_int() && other.is_uint() && bits() > other.bits();
}

bool Type::is_max(uint64_t value) const { return is_int_or_uint() && value == max_uint(); }
bool Type::is_max(int64_t value) const {
  return value >= 0 && is_max(static_cast<uint64_t>(value));
}
bool Type::is_min(int64_t value) const { return is_int_or_uint() && value == min_int(); }
bool Type::is_min(uint64_t value) const {
  return value <= INT64_MAX && is_min(static_cast<int64_t>(value));
}

uint32_t type_word(Type type) {
  // In the runtime's type codes, handle comes before bfloat.
  const uint32_t code = type.is_bfloat()   ? 4
                        : type.is_handle() ? 3
                                           : static_cast<uint32_t>(type.code());
  return code | static_cast<uint32_t>(type.bits()) << 8 | static_cast<uint32_t>(type.lanes()) << 16;
}

std::string to_string(Type type) {
  static constexpr const char* prefixes[] = {"int", "uint", "float", "bfloat", "handle"};
  std::string name = prefixes[static_cast<int>(type.code())];
  if (type.is_bool()) {
    name = "bool";
  } else if (!type.is_handle()) {
    name += std::to_string(type.bits());
  }
  return type.lanes() == 1 ? name : name + "x" + std::to_string(type.lanes());
}

}  // namespace retrograde

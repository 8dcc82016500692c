// Types of expressions: a scalar type code and width, and a number of lanes.
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <type_traits>

#include "layer_namespaces.h"

struct halide_type_t;
enum halide_type_code_t : uint8_t;

namespace retrograde {

class Expr;

enum class TypeCode : uint8_t { Int, UInt, Float, BFloat, Handle };

// A 16-bit float: a sign, an exponent and `mantissa` bits of mantissa.
template <class Self, int mantissa>
struct SmallFloat {
  static constexpr int mantissa_bits = mantissa;
  static constexpr uint16_t sign_mask = 0x8000, mantissa_mask = (1 << mantissa) - 1,
                            exponent_mask = 0x7fff & ~mantissa_mask;
  uint16_t bits = 0;
  static Self make_from_bits(uint16_t bits) {
    Self result;
    result.bits = bits;
    return result;
  }
  static Self make_zero() { return make_from_bits(0); }
  static Self make_negative_zero() { return make_from_bits(sign_mask); }
  static Self make_infinity() { return make_from_bits(exponent_mask); }
  static Self make_negative_infinity() { return make_from_bits(sign_mask | exponent_mask); }
  static Self make_nan() { return make_from_bits(exponent_mask | 1 << (mantissa - 1)); }
  uint16_t to_bits() const { return bits; }
  bool is_nan() const { return (bits & 0x7fff) > exponent_mask; }
  bool is_infinity() const { return (bits & 0x7fff) == exponent_mask; }
  bool is_negative() const { return (bits & sign_mask) != 0; }
  bool is_zero() const { return (bits & 0x7fff) == 0; }
  explicit operator int() const { return static_cast<int>(as_float()); }
  explicit operator double() const { return static_cast<double>(as_float()); }

 private:
  float as_float() const { return static_cast<float>(static_cast<const Self&>(*this)); }
};

// A 16-bit IEEE half. Arithmetic is in float32 and rounds to nearest even at each operation.
struct float16_t : SmallFloat<float16_t, 10> {
  float16_t() = default;
  explicit float16_t(float value);
  explicit float16_t(double value);
  explicit float16_t(int value) : float16_t(static_cast<float>(value)) {}
  explicit operator float() const;
};

// The upper half of a float32, rounded to nearest even.
struct bfloat16_t : SmallFloat<bfloat16_t, 7> {
  bfloat16_t() = default;
  explicit bfloat16_t(float value);
  explicit bfloat16_t(double value);
  explicit bfloat16_t(int value) : bfloat16_t(static_cast<float>(value)) {}
  explicit operator float() const;
};

// Arithmetic on the 16-bit floats: in float32, rounded after each operation.
template <typename T>
concept SmallFloatType = std::is_same_v<T, float16_t> || std::is_same_v<T, bfloat16_t>;
#define RETROGRADE_SMALL_FLOAT_OPERATOR(op)                   \
  template <SmallFloatType T>                                 \
  T operator op(T a, T b) {                                   \
    return T(static_cast<float>(a) op static_cast<float>(b)); \
  }                                                           \
  template <SmallFloatType T>                                 \
  T& operator op##=(T& a, T b) {                              \
    return a = a op b;                                        \
  }
RETROGRADE_SMALL_FLOAT_OPERATOR(+)
RETROGRADE_SMALL_FLOAT_OPERATOR(-)
RETROGRADE_SMALL_FLOAT_OPERATOR(*)
RETROGRADE_SMALL_FLOAT_OPERATOR(/)
#undef RETROGRADE_SMALL_FLOAT_OPERATOR
template <SmallFloatType T>
T operator-(T a) {
  return T::make_from_bits(a.bits ^ 0x8000);
}
template <SmallFloatType T>
bool operator==(T a, T b) {
  return static_cast<float>(a) == static_cast<float>(b);
}
template <SmallFloatType T>
auto operator<=>(T a, T b) {
  return static_cast<float>(a) <=> static_cast<float>(b);
}

class Type {
 public:
  static constexpr TypeCode Int = TypeCode::Int, UInt = TypeCode::UInt, Float = TypeCode::Float,
                            BFloat = TypeCode::BFloat, Handle = TypeCode::Handle;

  constexpr Type() = default;
  // Conversion from and to the runtime's type, which this folder only declares.
  Type(const halide_type_t& type);
  operator halide_type_t() const;
  Type(halide_type_code_t code, int bits, int lanes = 1);
  constexpr Type(TypeCode code, int bits, int lanes = 1)
      : code_(code), bits_(static_cast<uint8_t>(bits)), lanes_(static_cast<uint16_t>(lanes)) {}

  constexpr TypeCode code() const { return code_; }
  constexpr int bits() const { return bits_; }
  constexpr int bytes() const { return (bits_ + 7) / 8; }
  constexpr int lanes() const { return lanes_; }

  constexpr bool is_bool() const { return code_ == TypeCode::UInt && bits_ == 1; }
  constexpr bool is_int() const { return code_ == TypeCode::Int; }
  constexpr bool is_uint() const { return code_ == TypeCode::UInt; }
  constexpr bool is_int_or_uint() const { return is_int() || is_uint(); }
  constexpr bool is_float() const { return code_ == TypeCode::Float || code_ == TypeCode::BFloat; }
  constexpr bool is_bfloat() const { return code_ == TypeCode::BFloat; }
  constexpr bool is_handle() const { return code_ == TypeCode::Handle; }
  constexpr bool is_scalar() const { return lanes_ == 1; }
  constexpr bool is_vector() const { return lanes_ > 1; }

  constexpr Type with_lanes(int lanes) const { return Type(code_, bits_, lanes); }
  constexpr Type with_bits(int bits) const { return Type(code_, bits, lanes_); }
  constexpr Type with_code(TypeCode code) const { return Type(code, bits_, lanes_); }
  constexpr Type element_of() const { return with_lanes(1); }
  // The type with twice or half the bits; bool widens to 8 bits, 8 bits narrow to bool.
  constexpr Type widen() const { return with_bits(bits_ == 1 ? 8 : 2 * bits_); }
  constexpr Type narrow() const { return with_bits(bits_ == 8 ? 1 : bits_ / 2); }
  // Whether arithmetic beyond the range wraps around.
  constexpr bool can_overflow_int() const { return is_int() && bits_ <= 16; }
  constexpr bool can_overflow() const { return is_uint() || can_overflow_int(); }
  // Always true: handle types do not record their pointee.
  constexpr bool same_handle_type(const Type&) const { return true; }

  // The smallest and largest finite value of scalar integer types, as 64-bit patterns.
  int64_t min_int() const;
  int64_t max_int() const;
  uint64_t max_uint() const;
  // Whether the value survives conversion to this type unchanged (floats: up to rounding, within
  // range).
  bool can_represent(int64_t value) const;
  bool can_represent(uint64_t value) const;
  bool can_represent(double value) const;
  bool can_represent(Type other) const;  // every value of `other`
  // Whether the value is the largest (smallest) of this integer type.
  bool is_max(int64_t value) const;
  bool is_max(uint64_t value) const;
  bool is_min(int64_t value) const;
  bool is_min(uint64_t value) const;

  // The largest and smallest value as expressions; infinities for floats.
  // Requires: only numbers have one.
  Expr max() const;
  Expr min() const;

  friend constexpr bool operator==(const Type& a, const Type& b) = default;
  friend constexpr bool operator<(const Type& a, const Type& b) { return a.key() < b.key(); }
  constexpr uint32_t key() const {
    return static_cast<uint32_t>(code_) | static_cast<uint32_t>(bits_) << 8 |
           static_cast<uint32_t>(lanes_) << 16;
  }

 private:
  TypeCode code_ = TypeCode::Handle;
  uint8_t bits_ = 0;
  uint16_t lanes_ = 0;
};

constexpr Type Int(int bits, int lanes = 1) { return Type(TypeCode::Int, bits, lanes); }
constexpr Type UInt(int bits, int lanes = 1) { return Type(TypeCode::UInt, bits, lanes); }
constexpr Type Float(int bits, int lanes = 1) { return Type(TypeCode::Float, bits, lanes); }
constexpr Type BFloat(int bits, int lanes = 1) { return Type(TypeCode::BFloat, bits, lanes); }
constexpr Type Bool(int lanes = 1) { return UInt(1, lanes); }
constexpr Type Handle(int lanes = 1) { return Type(TypeCode::Handle, 64, lanes); }

template <typename T>
constexpr Type type_of() {
  if constexpr (std::is_same_v<T, bool>) {
    return Bool();
  } else if constexpr (std::is_same_v<T, float16_t>) {
    return Float(16);
  } else if constexpr (std::is_same_v<T, bfloat16_t>) {
    return BFloat(16);
  } else if constexpr (std::is_floating_point_v<T>) {
    static_assert(sizeof(T) <= 8, "no 80-bit floats");
    return Float(8 * sizeof(T));
  } else if constexpr (std::is_pointer_v<T>) {
    return Handle();
  } else if constexpr (std::is_signed_v<T>) {
    return Int(8 * sizeof(T));
  } else {
    static_assert(std::is_unsigned_v<T>, "no Retrograde type for this C++ type");
    return UInt(8 * sizeof(T));
  }
}

// "int32", "float32x8", "bfloat16", "bool", "handle"
std::string to_string(Type type);
// Code, bits and lanes in one word, as the runtime reads its halide_type_t.
uint32_t type_word(Type type);

}  // namespace retrograde

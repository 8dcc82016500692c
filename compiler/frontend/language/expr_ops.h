// expr_ops.h -- functions and operators on Exprs, beyond the arithmetic and comparisons of ir/build.h.
//
// Functions of real numbers compute in the type of a float argument and convert any other type to float32.
#pragma once

#include <type_traits>
#include <vector>

#include "frontend/language/tuple.h"
#include "ir/build.h"

namespace retrograde {

// ---- bitwise operators on integers: types are promoted as by +; a C++ int takes the other operand's type ----

// Requires: every operand must be a defined expression; it takes integers.
#define RETROGRADE_BIT_OPERATOR(name)               \
  Expr name(Expr a, Expr b);                        \
  inline Expr name(Expr a, int b) {                 \
    Expr constant = ir::constant_like(a, b, #name); \
    return name(std::move(a), std::move(constant)); \
  }                                                 \
  inline Expr name(int a, Expr b) {                 \
    Expr constant = ir::constant_like(b, a, #name); \
    return name(std::move(constant), std::move(b)); \
  }
RETROGRADE_BIT_OPERATOR(operator&)  // bitwise and
RETROGRADE_BIT_OPERATOR(operator|)  // bitwise or
RETROGRADE_BIT_OPERATOR(operator^)  // bitwise exclusive or
#undef RETROGRADE_BIT_OPERATOR
Expr operator~(Expr a);  // inverts every bit
// Shifts `a` left by `b` bits; a negative amount shifts right. The result has the type of `a`.
// Requires: every operand must be a defined expression; it takes integers.
Expr operator<<(Expr a, Expr b);
Expr operator<<(Expr a, int b);
// Shifts `a` right by `b` bits; a negative amount shifts left. The result has the type of `a`.
Expr operator>>(Expr a, Expr b);
Expr operator>>(Expr a, int b);

// ---- types ----

// Converts `value` to the type T.
template <typename T>
Expr cast(Expr value) {
  return cast(type_of<T>(), std::move(value));
}
// Converts `value` to `type`, clamped to the range of `type`.
// Requires: it takes and gives numbers.
Expr saturating_cast(Type type, Expr value);
template <typename T>
Expr saturating_cast(Expr value) {
  return saturating_cast(type_of<T>(), std::move(value));
}
// The bits of `value` as a value of `type`.
// Requires: both types are equally wide.
Expr reinterpret(Type type, Expr value);
template <typename T>
Expr reinterpret(Expr value) {
  return reinterpret(type_of<T>(), std::move(value));
}

// Casts under short names: u8(x) wraps, u8_sat(x) clamps.
namespace ConciseCasts {
#define RETROGRADE_CONCISE_CAST(name, type)                     \
  inline Expr name(Expr e) { return cast(type, std::move(e)); } \
  inline Expr name##_sat(Expr e) { return saturating_cast(type, std::move(e)); }
RETROGRADE_CONCISE_CAST(i8, Int(8))     // to int8
RETROGRADE_CONCISE_CAST(i16, Int(16))   // to int16
RETROGRADE_CONCISE_CAST(i32, Int(32))   // to int32
RETROGRADE_CONCISE_CAST(i64, Int(64))   // to int64
RETROGRADE_CONCISE_CAST(u8, UInt(8))    // to uint8
RETROGRADE_CONCISE_CAST(u16, UInt(16))  // to uint16
RETROGRADE_CONCISE_CAST(u32, UInt(32))  // to uint32
RETROGRADE_CONCISE_CAST(u64, UInt(64))  // to uint64
#undef RETROGRADE_CONCISE_CAST
inline Expr f32(Expr e) { return cast(Float(32), std::move(e)); }    // to float32
inline Expr f64(Expr e) { return cast(Float(64), std::move(e)); }    // to float64
inline Expr f16(Expr e) { return cast(Float(16), std::move(e)); }    // to float16
inline Expr bf16(Expr e) { return cast(BFloat(16), std::move(e)); }  // to bfloat16
}  // namespace ConciseCasts

// ---- choice ----

// The smallest of three or more values.
template <typename A, typename B, typename C, typename... Rest>
requires(std::is_convertible_v<A, Expr>&& std::is_convertible_v<B, Expr>&&
             std::is_convertible_v<C, Expr>) Expr min(A&& a, B&& b, C&& c, Rest&&... rest) {
  return min(min(Expr(std::forward<A>(a)), std::forward<B>(b)), std::forward<C>(c),
             std::forward<Rest>(rest)...);
}
// The largest of three or more values.
template <typename A, typename B, typename C, typename... Rest>
requires(std::is_convertible_v<A, Expr>&& std::is_convertible_v<B, Expr>&&
             std::is_convertible_v<C, Expr>) Expr max(A&& a, B&& b, C&& c, Rest&&... rest) {
  return max(max(Expr(std::forward<A>(a)), std::forward<B>(b)), std::forward<C>(c),
             std::forward<Rest>(rest)...);
}
// The value of the first condition that holds, else the last: select(c0, v0, c1, v1, otherwise).
template <typename... Rest>
requires(sizeof...(Rest) >= 1 && (std::is_convertible_v<Rest, Expr> && ...)) Expr
    select(Expr c0, Expr v0, Expr c1, Expr v1, Rest&&... rest) {
  return select(std::move(c0), std::move(v0),
                select(std::move(c1), std::move(v1), Expr(std::forward<Rest>(rest))...));
}
// Selects element by element; the condition is one Expr for all elements, or a Tuple with one for each.
// Requires: all Tuples have one size.
Tuple select(const Tuple& condition, const Tuple& when_true, const Tuple& when_false);
Tuple select(const Expr& condition, const Tuple& when_true, const Tuple& when_false);
template <typename... Rest>
requires(sizeof...(Rest) >= 1) Tuple
    select(const Expr& c0, const Tuple& v0, const Expr& c1, const Tuple& v1, Rest&&... rest) {
  return select(c0, v0, select(c1, v1, std::forward<Rest>(rest)...));
}
template <typename... Rest>
requires(sizeof...(Rest) >= 1) Tuple
    select(const Tuple& c0, const Tuple& v0, const Tuple& c1, const Tuple& v1, Rest&&... rest) {
  return select(c0, v0, select(c1, v1, std::forward<Rest>(rest)...));
}
// Halide's older name for select() of Tuples.
inline Tuple tuple_select(const Tuple& condition, const Tuple& t, const Tuple& f) {
  return select(condition, t, f);
}
inline Tuple tuple_select(const Expr& condition, const Tuple& t, const Tuple& f) {
  return select(condition, t, f);
}
template <typename Condition, typename... Rest>
requires(sizeof...(Rest) >= 1) Tuple
    tuple_select(const Condition& c0, const Tuple& v0, const Condition& c1, const Tuple& v1,
                 const Rest&... rest) {
  return tuple_select(c0, v0, tuple_select(c1, v1, rest...));
}
// values[id], or the last value if `id` is out of range.
// Requires: it chooses among at least one value.
Expr mux(const Expr& id, const std::vector<Expr>& values);
Expr mux(const Expr& id, const std::initializer_list<Expr>& values);
Expr mux(const Expr& id, const Tuple& values);

// ---- arithmetic ----

// Absolute value; the result for a signed integer is unsigned.
// Requires: it takes a number.
Expr abs(Expr x);
// |a - b| without overflow; the result for integers is unsigned.
Expr absd(Expr a, Expr b);
// Linear interpolation zero * (1 - weight) + one * weight. An unsigned weight of n bits represents weight /
// (2^n - 1).
// Requires: both values have one type; a constant end takes the type of the other and must fit it;
// integers are of at most 32 bits; its weight is a float or an unsigned integer; integers are
// interpolated with weights in [0, 1].
Expr lerp(Expr zero, Expr one, Expr weight);
// Interpolation of C++ numbers as Exprs; C++20's own lerp would compute in double.
template <typename Zero, typename One, typename Weight>
requires(std::is_arithmetic_v<Zero>&& std::is_arithmetic_v<One>&& std::is_arithmetic_v<Weight>) Expr
    lerp(Zero zero, One one, Weight weight) {
  return lerp(Expr(zero), Expr(one), Expr(weight));
}
// a * b + c, rounded once: the value of std::fma on every target, with or without strict_float. Slower than a
// product and a sum if the processor has no instruction for it.
// Requires: it takes floats.
Expr fma(Expr a, Expr b, Expr c);
// Integer division that rounds towards zero, as in C++; x / 0 is 0.
// Requires: it takes integers.
Expr div_round_to_zero(Expr a, Expr b);
// The remainder of div_round_to_zero, which has the sign of `a`.
Expr mod_round_to_zero(Expr a, Expr b);
// Number of bits that are set.
// Requires: it takes integers.
Expr popcount(Expr x);
Expr count_leading_zeros(Expr x);   // the width if x is 0
Expr count_trailing_zeros(Expr x);  // the width if x is 0

// ---- functions of real numbers ----

// The largest integer that is not above x, as a float.
// Requires: every operand must be a defined expression; it takes a number.
Expr floor(Expr x);
Expr ceil(Expr x);           // the smallest integer that is not below x, as a float
Expr round(Expr x);          // the nearest integer as a float, half to even
Expr trunc(Expr x);          // x without its fraction, as a float
Expr fract(Expr x);          // x - trunc(x), which has the sign of x
Expr sqrt(Expr x);           // square root
Expr exp(Expr x);            // e to the power x
Expr log(Expr x);            // natural logarithm
Expr pow(Expr x, Expr y);    // x to the power y; an integer constant y becomes multiplications
Expr hypot(Expr x, Expr y);  // sqrt(x * x + y * y)
Expr sin(Expr x);            // sine of x radians
Expr cos(Expr x);            // cosine of x radians
Expr tan(Expr x);            // tangent of x radians
Expr asin(Expr x);           // arc sine, in [-pi/2, pi/2]
Expr acos(Expr x);           // arc cosine, in [0, pi]
Expr atan(Expr x);           // arc tangent, in [-pi/2, pi/2]
Expr atan2(Expr y, Expr x);  // angle of the point (x, y), in [-pi, pi]
Expr sinh(Expr x);           // hyperbolic sine
Expr cosh(Expr x);           // hyperbolic cosine
Expr tanh(Expr x);           // hyperbolic tangent
Expr asinh(Expr x);          // inverse hyperbolic sine
Expr acosh(Expr x);          // inverse hyperbolic cosine
Expr atanh(Expr x);          // inverse hyperbolic tangent
Expr erf(Expr x);            // error function
Expr is_nan(Expr x);         // whether x is NaN
Expr is_inf(Expr x);         // whether x is an infinity
Expr is_finite(Expr x);      // whether x is neither NaN nor an infinity
// A faster, less accurate exp() of float32. The other fast_ functions relate to theirs likewise.
// Requires: it takes float32.
Expr fast_exp(Expr x);
Expr fast_log(Expr x);           // less accurate log()
Expr fast_pow(Expr x, Expr y);   // less accurate pow()
Expr fast_sin(Expr x);           // less accurate sin()
Expr fast_cos(Expr x);           // less accurate cos()
Expr fast_inverse(Expr x);       // less accurate 1 / x
Expr fast_inverse_sqrt(Expr x);  // less accurate 1 / sqrt(x)

// ---- random numbers ----

// Uniform float32 in [0, 1), a function of the seed, the Func and the point. It is the same in every run and
// on every target.
// Requires: its seed is an integer.
Expr random_float(Expr seed = {});
// Uniform uint32, drawn as random_float() draws.
Expr random_uint(Expr seed = {});
// Uniform int32, drawn as random_float() draws.
Expr random_int(Expr seed = {});

// ---- hints and promises: the value of the first argument ----
using ir::likely;  // loops may be partitioned so that the condition holds in most of them
Expr likely_if_innermost(Expr e);  // the same, in innermost loops only
// Promises that `value` lies in [min, max]; an undefined end means no limit.
Expr unsafe_promise_clamped(const Expr& value, const Expr& min, const Expr& max);
// The value of `e` without contraction to fused multiply-adds inside.
// Requires: every operand must be a defined expression.
Expr strict_float(Expr e);
// The value, with an explicit key for the cache of a memoized Func. The contents of images are not part of
// such a key by themselves; `key` holds Params and constants.
Expr memoize_tag(Expr value, const std::vector<Expr>& key);
template <std::convertible_to<Expr>... Keys>
Expr memoize_tag(Expr value, Keys&&... key) {
  return memoize_tag(std::move(value), std::vector<Expr>{Expr(std::forward<Keys>(key))...});
}
Expr stop_gradient(Expr e);  // the value of e, which derivatives treat as a constant

// No value: where a definition's value is undef, nothing is stored.
// Requires: the elements of a Tuple are undefined in the same places, or everywhere; a coordinate has
// a value, and undef has none.
Expr undef(Type type);
template <typename T>
Expr undef() {
  return undef(type_of<T>());
}

// ---- effects ----
namespace frontend {
inline void collect_parts(std::vector<Expr>&) {}
template <typename First, typename... Rest>
void collect_parts(std::vector<Expr>& parts, First&& first, Rest&&... rest) {
  parts.push_back(Expr(std::forward<First>(first)));
  collect_parts(parts, std::forward<Rest>(rest)...);
}
Expr print_values(std::vector<Expr> values);
Expr print_values_when(Expr condition, std::vector<Expr> values);
Expr require_values(Expr condition, std::vector<Expr> values);
}  // namespace frontend
// The first value; each evaluation also prints all values on one line.
// Requires: it returns its first argument; every operand must be a defined expression.
inline Expr print(const std::vector<Expr>& values) { return frontend::print_values(values); }
template <typename First, typename... Rest>
requires std::constructible_from<Expr, First> Expr print(First&& first, Rest&&... rest) {
  std::vector<Expr> values{Expr(std::forward<First>(first))};
  frontend::collect_parts(values, std::forward<Rest>(rest)...);
  return frontend::print_values(std::move(values));
}
// The first value; prints all values on one line if the condition holds.
// Requires: its condition is of type bool.
inline Expr print_when(Expr condition, const std::vector<Expr>& values) {
  return frontend::print_values_when(std::move(condition), values);
}
template <typename... Rest>
Expr print_when(Expr condition, Expr first, Rest&&... rest) {
  std::vector<Expr> values{std::move(first)};
  frontend::collect_parts(values, std::forward<Rest>(rest)...);
  return frontend::print_values_when(std::move(condition), std::move(values));
}
// The value if the condition holds; otherwise the call of the pipeline fails with the message.
// Requires: its condition is of type bool.
inline Expr require(Expr condition, const std::vector<Expr>& value_and_message) {
  return frontend::require_values(std::move(condition), value_and_message);
}
template <typename... Rest>
Expr require(Expr condition, Expr value, Rest&&... message) {
  std::vector<Expr> values{std::move(value)};
  frontend::collect_parts(values, std::forward<Rest>(message)...);
  return frontend::require_values(std::move(condition), std::move(values));
}

}  // namespace retrograde

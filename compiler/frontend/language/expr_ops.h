// expr_ops.h -- what can be written with Exprs beyond arithmetic and comparison (those are in
// ir/build.h).
//
// Functions of real numbers take float arguments as they are and convert any other type to float32.
#pragma once

#include <type_traits>
#include <vector>

#include "frontend/language/tuple.h"
#include "ir/build.h"

namespace retrograde {

// ---- bits: of integers; two types are promoted as by +, a C++ int takes the other one's ----
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
RETROGRADE_BIT_OPERATOR(operator&)
RETROGRADE_BIT_OPERATOR(operator|)
RETROGRADE_BIT_OPERATOR(operator^)
#undef RETROGRADE_BIT_OPERATOR
Expr operator~(Expr a);
// The result has the type of `a`; a negative amount shifts the other way.
// Requires: every operand must be a defined expression; it takes integers.
Expr operator<<(Expr a, Expr b);
Expr operator<<(Expr a, int b);
Expr operator>>(Expr a, Expr b);
Expr operator>>(Expr a, int b);

// ---- types ----
template <typename T>
Expr cast(Expr value) {
  return cast(type_of<T>(), std::move(value));
}
// Requires: it takes and gives numbers.
Expr saturating_cast(Type type, Expr value);  // clamped to the range of the type
template <typename T>
Expr saturating_cast(Expr value) {
  return saturating_cast(type_of<T>(), std::move(value));
}
// Requires: both types are equally wide.
Expr reinterpret(Type type, Expr value);  // same bits; both types equally wide
template <typename T>
Expr reinterpret(Expr value) {
  return reinterpret(type_of<T>(), std::move(value));
}

// cast by short names: u8_sat(x) clamps, u8(x) wraps.
namespace ConciseCasts {
#define RETROGRADE_CONCISE_CAST(name, type)                     \
  inline Expr name(Expr e) { return cast(type, std::move(e)); } \
  inline Expr name##_sat(Expr e) { return saturating_cast(type, std::move(e)); }
RETROGRADE_CONCISE_CAST(i8, Int(8))
RETROGRADE_CONCISE_CAST(i16, Int(16))
RETROGRADE_CONCISE_CAST(i32, Int(32))
RETROGRADE_CONCISE_CAST(i64, Int(64))
RETROGRADE_CONCISE_CAST(u8, UInt(8))
RETROGRADE_CONCISE_CAST(u16, UInt(16))
RETROGRADE_CONCISE_CAST(u32, UInt(32))
RETROGRADE_CONCISE_CAST(u64, UInt(64))
#undef RETROGRADE_CONCISE_CAST
inline Expr f32(Expr e) { return cast(Float(32), std::move(e)); }
inline Expr f64(Expr e) { return cast(Float(64), std::move(e)); }
inline Expr f16(Expr e) { return cast(Float(16), std::move(e)); }
inline Expr bf16(Expr e) { return cast(BFloat(16), std::move(e)); }
}  // namespace ConciseCasts

// ---- choice ----
template <typename A, typename B, typename C, typename... Rest>
requires(std::is_convertible_v<A, Expr>&& std::is_convertible_v<B, Expr>&&
             std::is_convertible_v<C, Expr>) Expr min(A&& a, B&& b, C&& c, Rest&&... rest) {
  return min(min(Expr(std::forward<A>(a)), std::forward<B>(b)), std::forward<C>(c),
             std::forward<Rest>(rest)...);
}
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
// Element by element; the condition is one for all, or a Tuple of its own.
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
// Halide's name for these.
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
// values[id]; the last one when id is out of range.
// Requires: it chooses among at least one value.
Expr mux(const Expr& id, const std::vector<Expr>& values);
Expr mux(const Expr& id, const std::initializer_list<Expr>& values);
Expr mux(const Expr& id, const Tuple& values);

// ---- arithmetic ----
// Requires: it takes a number.
Expr abs(Expr x);           // of signed integers: unsigned
Expr absd(Expr a, Expr b);  // |a - b| without overflow; of integers: unsigned
// zero * (1 - weight) + one * weight. An unsigned weight of n bits stands for weight / (2^n - 1).
// Requires: both values have one type; a constant end takes the type of the other and must fit it;
// integers are of at most 32 bits; its weight is a float or an unsigned integer; integers are
// interpolated with weights in [0, 1].
Expr lerp(Expr zero, Expr one, Expr weight);
// The same of C++ numbers alone, which C++20's own lerp would take to be doubles.
template <typename Zero, typename One, typename Weight>
requires(std::is_arithmetic_v<Zero>&& std::is_arithmetic_v<One>&& std::is_arithmetic_v<Weight>) Expr
    lerp(Zero zero, One one, Weight weight) {
  return lerp(Expr(zero), Expr(one), Expr(weight));
}
// a * b + c, rounded once: the value of std::fma on every target, in code that may contract and in
// strict_float. Slower than a product and a sum where the processor has no instruction for it.
// Requires: it takes floats.
Expr fma(Expr a, Expr b, Expr c);
// Requires: it takes integers.
Expr div_round_to_zero(Expr a, Expr b);  // as C++ does; x / 0 == 0
Expr mod_round_to_zero(Expr a, Expr b);
// Requires: it takes integers.
Expr popcount(Expr x);
Expr count_leading_zeros(Expr x);   // the width when x is 0
Expr count_trailing_zeros(Expr x);  // the width when x is 0

// ---- functions of real numbers ----
// Requires: every operand must be a defined expression; it takes a number.
Expr floor(Expr x);
Expr ceil(Expr x);
Expr round(Expr x);  // half to even
Expr trunc(Expr x);
Expr fract(Expr x);  // x - trunc(x): has the sign of x
Expr sqrt(Expr x);
Expr exp(Expr x);
Expr log(Expr x);
Expr pow(Expr x, Expr y);  // an integer constant y becomes multiplications
Expr hypot(Expr x, Expr y);
Expr sin(Expr x);
Expr cos(Expr x);
Expr tan(Expr x);
Expr asin(Expr x);
Expr acos(Expr x);
Expr atan(Expr x);
Expr atan2(Expr y, Expr x);
Expr sinh(Expr x);
Expr cosh(Expr x);
Expr tanh(Expr x);
Expr asinh(Expr x);
Expr acosh(Expr x);
Expr atanh(Expr x);
Expr erf(Expr x);
Expr is_nan(Expr x);
Expr is_inf(Expr x);
Expr is_finite(Expr x);
// Less exact, faster, float32 only.
// Requires: it takes float32.
Expr fast_exp(Expr x);
Expr fast_log(Expr x);
Expr fast_pow(Expr x, Expr y);
Expr fast_sin(Expr x);
Expr fast_cos(Expr x);
Expr fast_inverse(Expr x);
Expr fast_inverse_sqrt(Expr x);

// ---- random numbers: of the seed, the Func and the point; the same on every run ----
// All targets that a function is compiled for draw the same numbers.
// Requires: its seed is an integer.
Expr random_float(Expr seed = {});  // float32 in [0, 1)
Expr random_uint(Expr seed = {});   // uint32
Expr random_int(Expr seed = {});    // int32

// ---- hints and promises: the value of the first argument ----
using ir::likely;                  // the loop may be cut so that this holds in most of it
Expr likely_if_innermost(Expr e);  // only worth it in an innermost loop
Expr unsafe_promise_clamped(const Expr& value, const Expr& min,
                            const Expr& max);  // an undefined end: unlimited
// Requires: every operand must be a defined expression.
Expr strict_float(Expr e);  // no contraction to FMA inside
// The value, which a memoized Func's cache knows by `key`: what an image holds is no part of the
// cache's key by itself. Keys are made of Params and constants.
Expr memoize_tag(Expr value, const std::vector<Expr>& key);
template <std::convertible_to<Expr>... Keys>
Expr memoize_tag(Expr value, Keys&&... key) {
  return memoize_tag(std::move(value), std::vector<Expr>{Expr(std::forward<Keys>(key))...});
}
Expr stop_gradient(Expr e);  // a constant as far as derivatives go

// Any value: a definition whose value is undef stores nothing there.
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
// Of an operand of `what`.
void check_defined(const Expr& e, const char* what);
void check_integer(const Expr& e, const char* what);
}  // namespace frontend
// The first value; prints all of them, a line for each evaluation.
// Requires: it gives the value of its first argument; every operand must be a defined expression.
inline Expr print(const std::vector<Expr>& values) { return frontend::print_values(values); }
template <typename First, typename... Rest>
requires std::constructible_from<Expr, First> Expr print(First&& first, Rest&&... rest) {
  std::vector<Expr> values{Expr(std::forward<First>(first))};
  frontend::collect_parts(values, std::forward<Rest>(rest)...);
  return frontend::print_values(std::move(values));
}
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
// The value where the condition holds; elsewhere the call of the pipeline fails with the message.
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

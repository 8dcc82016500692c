// The table of operators and their evaluation on scalars. Floats narrower than 64 bits are computed
// in double and rounded once, so these are the exact functions that vector math approximates.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string_view>
#include <unordered_map>

#include "diagnostics/error.h"
#include "ir/operators.h"
#include "ir/scalar.h"

namespace retrograde::ir {

namespace {

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

// An unsigned amount beyond int64 shifts out every bit, like any amount of at least the width.
int64_t shift_amount(const Scalar& b) {
  constexpr int64_t far = 128;
  if (b.type.is_uint()) return b.u > static_cast<uint64_t>(far) ? far : static_cast<int64_t>(b.u);
  return b.i > far ? far : b.i < -far ? -far : b.i;
}

Scalar bits(const Scalar& a, uint64_t value) { return Scalar::of_uint(a.type, value); }

Scalar absolute(const Scalar& a, Type type) {
  return a.type.is_float() ? Scalar::of_float(type, std::fabs(a.f))
                           : Scalar::of_uint(type, magnitude(a));
}

Scalar difference(const Scalar& a, const Scalar& b, Type type) {
  if (a.type.is_float()) return Scalar::of_float(type, std::fabs(a.f - b.f));
  const bool less = a.type.is_int() ? a.i < b.i : a.u < b.u;
  return Scalar::of_uint(type, less ? b.u - a.u : a.u - b.u);
}

// ---- lerp ----

double unit_weight(const Scalar& weight) {
  if (weight.type.is_float()) return weight.f;
  return static_cast<double>(weight.u) / static_cast<double>(weight.type.max_uint());
}

// A weight is first converted to the width of the values, rounding down: 0.5 with 8 bits is 127 /
// 255. The product is computed in floats, so that the weight k / 65535.0f becomes k. (A narrower
// weight is the same fraction of its own range and needs no conversion.)
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
  if (a.type.bits() >= 64) return w * 2 > max ? b : a;  // unreachable: build rejects 64-bit lerps
  const Wide sum = widen(a) * (max - w) + widen(b) * w;
  const Wide half = max / 2;
  const Wide rounded = sum >= 0 ? (sum + half) / max : -((-sum + half) / max);
  return Scalar::of_int(a.type, static_cast<int64_t>(rounded));
}

Scalar interpolate(const Scalar& a, const Scalar& b, const Scalar& weight, Type type) {
  if (a.type.is_float()) {
    const double w = unit_weight(weight);
    return Scalar::of_float(type, a.f * (1 - w) + b.f * w);
  }
  if (a.type.is_bool()) return unit_weight(weight) > 0.5 ? b : a;
  return lerp_integers(a, b, fixed_point_weight(weight, a.type));
}

// ---- fma ----

// For operands whose product is exact in double. Rounding to odd records in the last bit that
// digits were cut off. Rounding the result to a type of half as many digits then rounds the exact
// sum (Boldo and Melquiond, 2008).
double sum_rounded_to_odd(double product, double c) {
  const double sum = product + c;
  const double taken = sum - product;
  const double lost = (product - (sum - taken)) + (c - taken);
  const auto bits = std::bit_cast<int64_t>(sum);
  if (!(lost < 0 || lost > 0) || bits % 2 != 0) return sum;
  return std::bit_cast<double>(bits + ((lost > 0) == (sum > 0) ? 1 : -1));
}

Scalar multiplied_and_added(const Scalar& a, const Scalar& b, const Scalar& c, Type type) {
  if (type.bits() == 64) return Scalar::of_float(type, std::fma(a.f, b.f, c.f));
  return Scalar::of_float(type, sum_rounded_to_odd(a.f * b.f, c.f));
}

// ---- others ----

Scalar saturated(Type type, const Scalar& a) {
  if (type == a.type) return a;
  if (type == Float(16)) {
    if (std::isnan(a.as_double())) return eval_cast(type, a);
    const double largest = 65504;
    return Scalar::of_float(type, std::clamp(a.as_double(), -largest, largest));
  }
  if (type.is_float()) return eval_cast(type, a);    // the ends of a float's range are infinities
  if (a.type.is_float()) return eval_cast(type, a);  // this cast saturates already
  if (a.type.is_int() ? type.can_represent(a.i) : type.can_represent(a.u))
    return eval_cast(type, a);
  const bool negative = a.type.is_int() && a.i < 0;
  return negative ? Scalar::of_int(type, type.min_int()) : Scalar::of_uint(type, type.max_uint());
}

uint64_t low_bits(const Scalar& a) {
  return a.type.bits() >= 64 ? a.u : a.u & (~uint64_t{0} >> (64 - a.type.bits()));
}
Scalar count_ones(const Scalar& a) { return Scalar::of_int(a.type, std::popcount(low_bits(a))); }
Scalar count_high_zeros(const Scalar& a) {
  return Scalar::of_int(a.type, std::countl_zero(low_bits(a)) - (64 - a.type.bits()));
}
Scalar count_low_zeros(const Scalar& a) {
  return Scalar::of_int(a.type, std::min(std::countr_zero(low_bits(a)), a.type.bits()));
}

// ---- the table ----

struct NoValue {};
constexpr NoValue no_value;

Scalar result(Type type, double value) { return Scalar::of_float(type, value); }
Scalar result(Type, bool value) { return Scalar::of_bool(value); }
Scalar result(Type, const Scalar& value) { return value; }
Scalar result(Type, NoValue) { internal_error("an operator without a scalar meaning"); }

using enum OpClass;
using enum BoundsRule;
using enum Monotone;
using enum Infinite;
using enum Nan;
using enum Levels;
using enum PartialPoles;
using enum Conduct;
using Real = RealFacts;

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr Values anything{-inf, inf}, positive{0, inf}, truth{0, 1};  // `positive` includes 0

constexpr OpError exact{.kind = OpError::Kind::Exact};
constexpr OpError arithmetic{.kind = OpError::Kind::Arithmetic};
constexpr OpError library(double ulp_float32, double ulp_float64, int ulp_elsewhere = 4) {
  return {OpError::Kind::Library, ulp_float32, ulp_float64, ulp_elsewhere};
}
constexpr OpError approximates(Op of) { return {.kind = OpError::Kind::Approximates, .of = of}; }

constexpr Real same{Rises, StaysFinite, NoNan, NeverLevel, NoPoles, exact};
constexpr Real steps = same;
constexpr Real discrete{Turns, StaysFinite, NoNan, NeverLevel, NoPoles, exact};

constexpr Work no_work{0, 0, 0}, one_add{1, 0, 0}, two_adds{2, 0, 0};
// A function that costs as much as `adds` additions.
constexpr Work function(int adds) { return {0, 0, 1, adds}; }

constexpr OpInfo op_table[] = {
#define RETROGRADE_OP(name, arity, cls, value, ...)                             \
  {#name, arity, cls,                                                           \
   []([[maybe_unused]] const Scalar& a, [[maybe_unused]] const Scalar& b,       \
      [[maybe_unused]] const Scalar& c, [[maybe_unused]] Type type) -> Scalar { \
     [[maybe_unused]] const double x = a.f, y = b.f;                            \
     return result(type, value);                                                \
   },                                                                           \
   __VA_ARGS__},
#include "ir/operators.def"
    {"none", 0, Internal, [](const Scalar& a, const Scalar&, const Scalar&, Type) { return a; },
     OfType, anything, discrete, no_work, Silent},
};

constexpr bool is_total() {
  for (const OpInfo& row : op_table) {
    if (unstated_column(row)) return false;
  }
  return true;
}
static_assert(is_total(), "a row of operators.def leaves a column out");

}  // namespace

const OpInfo& op_info(Op op) { return op_table[static_cast<int>(op)]; }

Op op_from_name(const std::string& name) {
  static const std::unordered_map<std::string_view, Op> by_name = [] {
    std::unordered_map<std::string_view, Op> result;
    for (int i = 0; i < op_count; ++i) result.emplace(op_table[i].name, static_cast<Op>(i));
    return result;
  }();
  return value_or(by_name, name, Op::none);
}

int passed_operand(Op op) {
  const OpInfo& info = op_info(op);
  if (info.cls == Marker || info.bounds == OfFirst) return 0;
  return info.bounds == OfSecond ? 1 : -1;
}

bool is_risky_op(Op op) {
  const RealFacts& real = op_info(op).real;
  return real.infinite == Explodes || real.infinite == Somewhere || real.nan == NanOutside;
}

bool acts(Op op) {
  const Conduct conduct = op_info(op).conduct;
  return conduct == Acts || conduct == ActsInPlace;
}

Op exact_form(Op op) {
  const Op of = op_info(op).real.error.of;
  return of == Op::none ? op : of;
}

std::optional<Scalar> eval_operator(Op op, const std::vector<Scalar>& args, Type type) {
  const OpInfo& info = op_info(op);
  if (info.cls != Pure && info.cls != Marker) return std::nullopt;
  RETROGRADE_ASSERT(info.arity < 0 || static_cast<int>(args.size()) == info.arity, info.name,
                    " of ", args.size(), " arguments");
  const auto arg = [&](size_t i) { return i < args.size() ? args[i] : Scalar(); };
  return info.value(arg(0), arg(1), arg(2), type.element_of());
}

}  // namespace retrograde::ir

// Error propagation: per operation, the errors of the operands times the partial derivatives, plus
// the roundings that the model lets happen elsewhere.
#include "testing/tracked_value.h"

#include <algorithm>
#include <cmath>

#include "diagnostics/error.h"

namespace retrograde::oracle {

using namespace ir;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

int mantissa_bits(Type type) {
  if (type.is_bfloat()) return 7;
  return type.bits() == 16 ? 10 : type.bits() == 32 ? 23 : 52;
}

int min_exponent(Type type) {
  if (type.is_bfloat()) return -126;
  return type.bits() == 16 ? -14 : type.bits() == 32 ? -126 : -1022;
}

// The rounding that a +, - or * of float type really made: 0 when it was exact. In double for
// narrower types (exact for their products), with the two-sum and fma residuals for float64.
double rounding_residual(Kind kind, const Scalar& a, const Scalar& b, const Scalar& result) {
  const double r = result.f;
  if (!std::isfinite(r)) return 0;
  if (kind == Kind::Mul) return std::fabs(std::fma(a.f, b.f, -r));
  const double y = kind == Kind::Sub ? -b.f : b.f;
  if (result.type.bits() < 64) return std::fabs(a.f + y - r);
  const double virtual_y = r - a.f;
  return std::fabs((a.f - (r - virtual_y)) + (y - virtual_y));
}

// The rounding error of a cast to a narrower float. float32(float64(a) * float64(b)) is exactly the product of float32,
// and a compiler that computes it so may contract it: then this rounding is gone.
double narrowing_residual(const Scalar& a, const Scalar& result) {
  if (!a.type.is_float() || !result.type.is_float()) return 0;
  return std::isfinite(result.f) ? std::fabs(a.f - result.f) : 0;
}

// The error that reaches the result through the operands.
double propagated(Kind kind, const Value& a, const Value& b, double result) {
  const double x = std::fabs(a.scalar.f), y = std::fabs(b.scalar.f);
  switch (kind) {
    case Kind::Mul:
      if (a.error == 0 && b.error == 0) return 0;
      return (b.error ? x * b.error : 0) + (a.error ? y * a.error : 0) + a.error * b.error;
    case Kind::Div: {
      if (a.error == 0 && b.error == 0) return 0;
      if (y <= b.error) return infinity;
      return (a.error + std::fabs(result) * b.error) / (y - b.error);
    }
    case Kind::Min:
    case Kind::Max:
      return std::max(a.error, b.error);
    default:
      return a.error + b.error;
  }
}

bool is_comparison(Kind kind) { return kind >= Kind::EQ && kind <= Kind::GE; }

Value compare(const Value& a, const Value& b, const Scalar& result) {
  const double doubt = a.error + b.error;
  if (doubt == 0) return {result};
  if (!a.scalar.type.is_float()) return Value::unstable(result);
  const double gap = std::fabs(a.scalar.f - b.scalar.f);
  return gap > doubt || std::isnan(gap) ? Value{result} : Value::unstable(result);
}

// A float remainder jumps where a / b crosses an integer.
Value float_mod(const Value& a, const Value& b, const Scalar& result) {
  if (a.error == 0 && b.error == 0) return {result, ulp(result.type, a.scalar.f)};
  const double quotient = a.scalar.f / b.scalar.f;
  const double doubt = propagated(Kind::Div, a, b, quotient) + ulp(result.type, quotient);
  if (!(std::floor(quotient - doubt) == std::floor(quotient + doubt)))
    return Value::unstable(result);
  const double error = a.error + std::fabs(quotient) * b.error + ulp(result.type, a.scalar.f);
  return {result, error};
}

Value float_binary(Rounding rounding, Kind kind, const Value& a, const Value& b, Scalar result) {
  if (kind == Kind::Mod) return float_mod(a, b, result);
  double error = propagated(kind, a, b, result.f);
  const bool is_sum = kind == Kind::Add || kind == Kind::Sub;
  if (is_sum || kind == Kind::Mul) {
    if (error > 0) error += ulp(result.type, result.f);
    if (kind == Kind::Mul || rounding == Rounding::Reordering) {
      error += rounding_residual(kind, a.scalar, b.scalar, result);
    }
    // A sum that is exact in this order is rounded in others.
    if (is_sum && rounding == Rounding::Reordering) error += ulp(result.type, result.f) / 2;
  } else if (kind == Kind::Div) {
    if (error > 0) error += ulp(result.type, result.f);
    if (rounding == Rounding::Reordering) error += 2 * ulp(result.type, result.f);
  }
  if (std::isnan(error)) error = infinity;
  return {result, error};
}

// Not rounded to the type: errors are often smaller than its ULP.
Scalar shifted(const Value& value, double by) {
  Scalar result = value.scalar;
  result.f += by;
  return result;
}

bool same_value(const Scalar& a, const Scalar& b) {
  if (!a.type.is_float()) return a.u == b.u;
  return a.f == b.f || (std::isnan(a.f) && std::isnan(b.f));
}

std::vector<Scalar> scalars_of(const std::vector<Value>& values) {
  return ir::mapped(values, &Value::scalar);
}

// Moves one operand at a time to the ends of its uncertainty and adds up what the result does.
double sensitivity(Op op, const std::vector<Value>& args, Type type, const Scalar& result) {
  double error = 0;
  std::vector<Scalar> moved = scalars_of(args);
  for (size_t i = 0; i < args.size(); ++i) {
    if (args[i].error == 0) continue;
    if (!args[i].scalar.type.is_float() || !args[i].is_stable()) return infinity;
    double worst = 0;
    for (const double sign : {-1.0, 1.0}) {
      moved[i] = shifted(args[i], sign * args[i].error);
      const Scalar other = *ir::eval_operator(op, moved, type);
      if (same_value(other, result)) continue;
      if (!type.is_float()) return infinity;
      const double distance = std::fabs(other.f - result.f);
      worst = std::isnan(distance) ? infinity : std::max(worst, distance);
    }
    moved[i] = args[i].scalar;
    error += worst;
  }
  return error;
}

bool has_error(const std::vector<Value>& args) {
  return std::any_of(args.begin(), args.end(), [](const Value& v) { return v.error > 0; });
}

// Floats that stay the same until an operand crosses a threshold.
bool is_discrete(Op op) {
  return op == Op::floor || op == Op::ceil || op == Op::round || op == Op::trunc;
}

constexpr int fast_bits = 11;  // precision of the fast functions

// Errors of the implementation itself, on exact operands.
double own_error(Op op, Rounding rounding, const std::vector<Value>& args, const Scalar& result) {
  const double r = result.f;
  if (!std::isfinite(r)) return 0;
  const ir::OpError& error = op_info(op).real.error;
  if (error.kind == ir::OpError::Kind::Approximates)
    return std::ldexp(std::max(std::fabs(r), 1.0), -fast_bits);
  if (error.kind == ir::OpError::Kind::Library) return error.ulp_elsewhere * ulp(result.type, r);
  if (op == Op::lerp) {
    return 2 * ulp(result.type, std::max(std::fabs(args[0].scalar.as_double()),
                                         std::fabs(args[1].scalar.as_double())));
  }
  if (op == Op::strong_mul) {
    return rounding_residual(Kind::Mul, args[0].scalar, args[1].scalar, result);
  }
  if (op == Op::strong_div && rounding == Rounding::Reordering) return 2 * ulp(result.type, r);
  if (op == Op::absd && rounding == Rounding::Reordering) {
    return rounding_residual(Kind::Sub, args[0].scalar, args[1].scalar, result);
  }
  return 0;
}

}  // namespace

double ulp(Type type, double x) {
  if (!std::isfinite(x)) return 0;
  const int exponent = x == 0 ? min_exponent(type) : std::max(std::ilogb(x), min_exponent(type));
  return std::ldexp(1.0, exponent - mantissa_bits(type));
}

Value apply_binary(Rounding rounding, Kind kind, const Value& a, const Value& b) {
  if (a.is_undef() || b.is_undef()) return Value::undef();
  const Scalar result = ir::eval_binary(kind, a.scalar, b.scalar);
  if (rounding == Rounding::Strict) return {result};
  if (is_comparison(kind)) return compare(a, b, result);
  if (result.type.is_float()) return float_binary(rounding, kind, a, b, result);
  return a.error + b.error == 0 ? Value{result} : Value::unstable(result);
}

Value apply_not(const Value& a) {
  if (a.is_undef()) return a;
  return {ir::eval_not(a.scalar), a.error};
}

Value apply_cast(Rounding rounding, Type type, const Value& a) {
  if (a.is_undef()) return a;
  const Scalar result = ir::eval_cast(type, a.scalar);
  if (rounding == Rounding::Strict) return {result};
  if (a.error == 0) return {result, narrowing_residual(a.scalar, result)};
  if (!a.is_stable() || !a.scalar.type.is_float()) return Value::unstable(result);
  if (type.is_float()) return {result, a.error + ulp(type, result.f)};
  for (const double sign : {-1.0, 1.0}) {
    const Scalar other = ir::eval_cast(type, shifted(a, sign * a.error));
    if (!same_value(other, result)) return Value::unstable(result);
  }
  return {result};
}

Value apply_reinterpret(Type type, const Value& a) {
  if (a.is_undef()) return a;
  return {ir::eval_reinterpret(type, a.scalar), a.error == 0 ? 0 : infinity};
}

Value apply_operator(Rounding rounding, Op op, const std::vector<Value>& args, Type type) {
  for (const Value& arg : args) {
    if (arg.is_undef()) return Value::undef();
  }
  const auto result = ir::eval_operator(op, scalars_of(args), type);
  if (!result) internal_error(std::string("no scalar meaning of operator ") + op_info(op).name);
  if (rounding == Rounding::Strict) return {*result};
  const bool is_strong = op == Op::strong_mul || op == Op::strong_div;
  if (is_strong && args[0].error == 0 && args[0].scalar.f == 0) return {*result};
  double error = sensitivity(op, args, type, *result);
  if (type.is_float()) {
    if (has_error(args) && !is_discrete(op)) error += ulp(type, result->f);
    error += own_error(op, rounding, args, *result);
  }
  return {*result, error};
}

}  // namespace retrograde::oracle

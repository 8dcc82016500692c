// Bounds of calls: the value of a Func, and of an operator by the row of operators.def or by its own rule.
#include <algorithm>
#include <cmath>

#include "analysis/bounds_engine.h"
#include "analysis/interval_arithmetic.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/scalar.h"

namespace retrograde::analysis {

Interval BoundsEngine::call_bounds(const Call& call) {
  switch (call.call_type) {
    case CallType::Func:
      return value_of_func(call);
    case CallType::Operator:
      return operator_bounds(call);
    default:
      return type_range(call.type);
  }
}

Interval BoundsEngine::value_of_func(const Call& call) {
  if (!shared_->values) return type_range(call.type);
  auto it = shared_->values->find({call.name, call.component});
  return it == shared_->values->end() ? type_range(call.type) : it->second;
}

// If an operand may be NaN, or infinite where that gives NaN, the value is unbounded.
Interval BoundsEngine::bounds_within(const Call& call, const OpInfo& info) {
  if (info.real.nan == Nan::NanOutside) return Interval::everything();
  for (const Expr& arg : call.args) {
    const Interval v = bounds(arg);
    const bool is_number = v.min.defined() || v.max.defined();
    if (info.real.nan == Nan::NanAtInfinity ? !v.is_bounded() : !is_number)
      return Interval::everything();
  }
  const auto end = [&](double value) {
    return std::isfinite(value) ? make_const(call.type, value) : Expr();
  };
  return {end(info.values.low), end(info.values.high)};
}

// For an increasing function with a value at the lower end, all values are above that one.
Interval BoundsEngine::bounds_at_ends(const Call& call, const OpInfo& info) {
  const Interval v = bounds(call.args[0]);
  if (info.real.nan == Nan::NanOutside) {
    const auto low = v.min.defined() ? as_scalar(v.min) : std::nullopt;
    if (!low || std::isnan(eval_operator(call.op, {*low}, call.type)->f))
      return Interval::everything();
  }
  return interval_monotone(call.op, call.type, v);
}

Interval BoundsEngine::operator_bounds(const Call& call) {
  const OpInfo& info = op_info(call.op);
  switch (info.bounds) {
    case BoundsRule::OfFirst:
    case BoundsRule::OfSecond:
      return bounds(call.args[static_cast<size_t>(passed_operand(call.op))]);
    case BoundsRule::AtEnds:
      return bounds_at_ends(call, info);
    case BoundsRule::Within:
      return bounds_within(call, info);
    case BoundsRule::ByRule:
      return bounds_by_rule(call);
    case BoundsRule::OfType:
      break;
  }
  return type_range(call.type);
}

Interval BoundsEngine::bounds_by_rule(const Call& call) {
  Type type = call.type;
  auto arg = [&](int i) { return bounds(call.args[i]); };
  switch (call.op) {
    case Op::promise_clamped:
      return interval_between(arg(0), arg(1), arg(2));
    case Op::unsafe_promise_clamped:
      return interval_clamp(arg(0), arg(1), arg(2));
    case Op::if_then_else:
      return select_bounds(call.args[0], call.args[1], call.args[2]);
    case Op::abs:
      return interval_abs(type, call.args[0].type(), arg(0));
    case Op::absd:
      return interval_absd(type, call.args[0].type(), arg(0), arg(1));
    case Op::bitwise_and:
    case Op::bitwise_or:
    case Op::bitwise_xor:
      return interval_bitwise(call.op, type, arg(0), arg(1));
    case Op::shift_left:
    case Op::shift_right:
      return interval_shift(call.op, type, arg(0), arg(1));
    case Op::lerp:
      return type.is_float() ? Interval::everything() : hull(arg(0), arg(1));
    case Op::fma:
      return interval_fma(arg(0), arg(1), arg(2));
    case Op::saturating_cast: {
      Interval v = arg(0), range = type_range(type);
      Type from = call.args[0].type();
      if (from.is_float() || !type.can_represent(from)) return range;
      return interval_cast(type, from, v);
    }
    case Op::popcount:
    case Op::count_leading_zeros:
    case Op::count_trailing_zeros:
      return constant_interval(type, 0, call.args[0].type().bits());
    case Op::random:
      return type.is_float() ? Interval{make_zero(type), make_one(type)} : type_range(type);
    default:
      internal_error(text("no rule for the bounds of ", op_info(call.op).name));
  }
}

}  // namespace retrograde::analysis

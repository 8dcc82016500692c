#include "autodiff/rules/value_range.h"

#include <algorithm>
#include <cmath>

#include "autodiff/sweeps/local_derivative.h"
#include "ir/build.h"
#include "ir/equal.h"

namespace retrograde::autodiff {

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double largest_exponent = 88;  // exp of more may overflow float32

ValueRange between(double min, double max, bool infinite = false) {
  return {{min, max}, infinite && (min == -inf || max == inf)};
}
ValueRange constant(double value) {
  return std::isnan(value) ? ValueRange{} : between(value, value, std::isinf(value));
}
ValueRange joined(const ValueRange& a, const ValueRange& b) {
  return {hull<double>(a, b), a.infinite || b.infinite};
}
bool excludes_zero(const ValueRange& a) { return !a.contains(0); }

// The range from `low` to `high`; NaN means no bound.
ValueRange from_ends(double low, double high, bool infinite) {
  return between(std::isnan(low) ? -inf : low, std::isnan(high) ? inf : high, infinite);
}

ValueRange sum(const ValueRange& a, const ValueRange& b) {
  return from_ends(a.min + b.min, a.max + b.max, a.infinite || b.infinite);
}
ValueRange negated(const ValueRange& a) { return {{-a.max, -a.min}, a.infinite}; }

ValueRange product(const ValueRange& a, const ValueRange& b) {
  double low = inf, high = -inf;
  for (double x : {a.min, a.max}) {
    for (double y : {b.min, b.max}) {
      const double end = x == 0 || y == 0 ? 0 : x * y;
      low = std::min(low, end);
      high = std::max(high, end);
    }
  }
  return between(low, high, a.infinite || b.infinite);
}
ValueRange square(const ValueRange& a) {
  const double low = std::min(std::abs(a.min), std::abs(a.max));
  const double high = std::max(std::abs(a.min), std::abs(a.max));
  return between(excludes_zero(a) ? low * low : 0, high * high, a.infinite);
}
// The divisor 0 may be -0, so a quotient by it may be infinite of either sign.
ValueRange quotient(const ValueRange& a, const ValueRange& b) {
  if (!excludes_zero(b)) return {{}, true};
  return product(a, between(1 / b.max, 1 / b.min));
}

// If one operand is NaN, the result is the second operand, so the first operand bounds one side only.
ValueRange smaller(const ValueRange& a, const ValueRange& b) {
  return between(std::min(a.min, b.min), b.max, a.infinite || b.infinite);
}
ValueRange larger(const ValueRange& a, const ValueRange& b) {
  return negated(smaller(negated(a), negated(b)));
}

ValueRange magnitude(const ValueRange& a) {
  const double high = std::max(std::abs(a.min), std::abs(a.max));
  return between(excludes_zero(a) ? std::min(std::abs(a.min), std::abs(a.max)) : 0, high,
                 a.infinite);
}
ValueRange exponential(const ValueRange& a) {
  const double high = a.max > largest_exponent ? inf : std::exp(a.max);
  return between(std::exp(a.min), high, true);
}
ValueRange logarithm(const ValueRange& a) {
  const double low = a.min > 0 ? std::log(a.min) : -inf;
  return between(low, a.max > 0 ? std::log(a.max) : inf, a.infinite || a.min <= 0);
}
ValueRange root(const ValueRange& a) {
  return between(std::sqrt(std::max(a.min, 0.0)), std::sqrt(std::max(a.max, 0.0)), a.infinite);
}

// A number to a constant, positive power is finite.
ValueRange power(const ValueRange& a, const ValueRange& exponent) {
  if (exponent == constant(2)) return square(a);
  const bool is_known = exponent.min == exponent.max && exponent.min > 0;
  return between(a.min >= 0 ? 0 : -inf, inf, a.infinite || !is_known);
}

// `infinite`: whether one of the operands may be infinite.
ValueRange of_operator(Op op, const std::vector<ValueRange>& a, bool infinite) {
  if (const int passed = passed_operand(op); passed >= 0) return a[static_cast<size_t>(passed)];
  switch (exact_form(op)) {
    case Op::abs:
      return magnitude(a[0]);
    case Op::sqrt:
      return root(a[0]);
    case Op::exp:
      return exponential(a[0]);
    case Op::log:
      return logarithm(a[0]);
    case Op::hypot:
      return root(sum(square(a[0]), square(a[1])));
    case Op::pow:
      return power(a[0], a[1]);
    case Op::fma:
      return sum(product(a[0], a[1]), a[2]);
    case Op::strong_mul:
      return product(joined(a[0], constant(0)), a[1]);
    case Op::strong_div:
      return quotient(joined(a[0], constant(0)), a[1]);
    case Op::if_then_else:
      return joined(a[1], a[2]);
    default:
      break;
  }
  const Values& values = op_info(exact_form(op)).values;
  return between(values.low, values.high, infinite || is_risky_op(op));
}

// Whether a * b is -x * x, which is how -(x * x) is often written.
bool is_negation_of(const Expr& a, const Expr& b) {
  const auto* difference = a.as<Sub>();
  return difference && is_zero(difference->a) && equal(difference->b, b);
}

ValueRange of_binary(const Binary& e, const ValueRange& a, const ValueRange& b) {
  switch (e.kind) {
    case Kind::Add:
      return sum(a, b);
    case Kind::Sub:
      return sum(a, negated(b));
    case Kind::Mul:
      return equal(e.a, e.b)            ? square(a)
             : is_negation_of(e.a, e.b) ? negated(square(b))
                                        : product(a, b);
    case Kind::Div:
      return quotient(a, b);
    case Kind::Min:
      return smaller(a, b);
    case Kind::Max:
      return larger(a, b);
    default:
      return between(-inf, inf, a.infinite || b.infinite);
  }
}

// Whether e is x * (c * x), (c * x) * x or the like, as exponents of Gaussians are often written. Then `base` is x.
bool is_scaled_square(const Mul& e, Expr& scale, Expr& base) {
  for (const auto& [scaled, other] : {std::pair(e.a, e.b), std::pair(e.b, e.a)}) {
    const auto* product = scaled.as<Mul>();
    if (!product) continue;
    const bool is_first = equal(product->a, other);
    if (!is_first && !equal(product->b, other)) continue;
    scale = is_first ? product->b : product->a;
    base = other;
    return true;
  }
  return false;
}

// The range of a constant, or of a node given the ranges `of` the nodes below it.
ValueRange range_of_node(const Expr& e, FunctionRef<ValueRange(const Expr&)> of) {
  if (auto value = as_const_float(e)) return constant(*value);
  if (!e.type().is_float()) return {};
  Expr scale, base;
  if (const auto* mul = e.as<Mul>(); mul && is_scaled_square(*mul, scale, base))
    return product(of(scale), square(of(base)));
  if (const auto* binary = e.as<Binary>()) return of_binary(*binary, of(binary->a), of(binary->b));
  if (const auto* choice = e.as<Select>())
    return joined(of(choice->when_true), of(choice->when_false));
  if (const auto* cast = e.as<Cast>())
    return cast->value.type().is_uint() ? between(0, inf) : of(cast->value);
  std::vector<ValueRange> operands;
  bool infinite = false;
  for_each_child(e, [&](const Expr& child) {
    operands.push_back(of(child));
    infinite |= operands.back().infinite;
  });
  const auto* call = e.as<Call>();
  if (call && call->call_type == CallType::Operator)
    return of_operator(call->op, operands, infinite);
  return between(-inf, inf, infinite);
}

// Widens each bound of `next` that grew beyond `before`.
ValueRange widened(const ValueRange& before, const ValueRange& next) {
  ValueRange result = next;
  if (next.min < before.min) result.min = next.min >= 0 ? 0 : -inf;
  if (next.max > before.max) result.max = next.max <= 0 ? 0 : inf;
  return result;
}

}  // namespace

ValueRanges::ValueRanges(const std::vector<FuncPtr>& order) {
  for (const FuncPtr& f : order) add(f);
}

ValueRange ValueRanges::of_leaf(const Expr& leaf) const {
  const auto* call = leaf.as<Call>();
  if (!call || !leaf.type().is_float()) return {};
  auto found = funcs_.find(call->symbol.raw());
  return found == funcs_.end() ? ValueRange{} : found->second[static_cast<size_t>(call->component)];
}

ValueRange ValueRanges::of(const Expr& e) const {
  if (is_leaf(e)) return of_leaf(e);
  std::unordered_map<const ExprNode*, ValueRange> known;
  for (const Expr& node : post_order({e})) {
    known[node.get()] = is_leaf(node) ? of_leaf(node) : range_of_node(node, [&](const Expr& child) {
      return known.at(child.get());
    });
  }
  return known.at(e.get());
}

std::vector<ValueRange> ValueRanges::of_stage(const Definition& stage) const {
  return mapped(stage.values, [&](const Expr& value) { return of(without_lets(value)); });
}

bool ValueRanges::is_promised_finite(const Expr& leaf) const {
  const auto* call = leaf.as<Call>();
  if (!call) return false;
  if (call->call_type == CallType::Func) return promised_.contains(call->symbol.raw());
  const auto* image = dynamic_cast<const ParameterContents*>(call->symbol.raw());
  return image && image->is_finite;
}

// Whether the value only selects among constants and elements promised finite, and computes nothing that could
// overflow.
bool ValueRanges::only_passes_on(const Expr& value) const {
  if (auto number = as_const_float(value)) return std::isfinite(*number);
  if (!value.type().is_float()) return true;
  if (is_leaf(value)) return is_promised_finite(value);
  if (const auto* choice = value.as<Select>())
    return only_passes_on(choice->when_true) && only_passes_on(choice->when_false);
  if (const auto* cast = value.as<Cast>())
    return value.type().can_represent(cast->value.type()) && only_passes_on(cast->value);
  if (const auto* e = value.as<Binary>(); e && (e->kind == Kind::Min || e->kind == Kind::Max))
    return only_passes_on(e->a) && only_passes_on(e->b);
  const auto* call = value.as<Call>();
  const int passed = call && call->call_type == CallType::Operator ? passed_operand(call->op) : -1;
  return passed >= 0 && only_passes_on(call->args[static_cast<size_t>(passed)]);
}

void ValueRanges::add(const FuncPtr& f) {
  if (f->is_extern()) return;
  const auto passes_on = [&](const Expr& value) { return only_passes_on(without_lets(value)); };
  const bool is_promised =
      f->updates.empty() && std::all_of(f->pure->values.begin(), f->pure->values.end(), passes_on);
  if (is_promised) promised_.insert(f.get());
  std::vector<ValueRange>& own = funcs_[f.get()];
  own = of_stage(*f->pure);
  for (bool grows = true; grows;) {
    std::vector<ValueRange> next = own;
    for (int s = 1; s < f->stage_count(); ++s) {
      const std::vector<ValueRange> written = of_stage(f->stage(s));
      for (size_t k = 0; k < next.size(); ++k) next[k] = joined(next[k], written[k]);
    }
    for (size_t k = 0; k < next.size(); ++k) next[k] = widened(own[k], next[k]);
    grows = next != own;
    own = next;
  }
}

}  // namespace retrograde::autodiff

#include "lower/loops/needed_where.h"

#include "analysis/interval.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/markers.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int largest_condition =
    40;  // nodes; evaluating larger conditions costs more than it saves

bool is_usable(const Expr& e) {
  int nodes = 0;
  return !any_node(e, [&](const Expr& node) {
    const auto* call = node.as<Call>();
    const bool is_pure =
        !call || call->call_type != CallType::Operator || op_info(call->op).cls == OpClass::Pure;
    return ++nodes > largest_condition || !is_pure || node.as<Load>() || node.as<ir::Let>() ||
           node.as<Broadcast>() || node.type().lanes() > 1;
  });
}

// The negated condition; comparisons of floats are not reversed, because of NaN.
Expr negation(const Expr& e) {
  const auto* compared = e.as<Binary>();
  if (!compared || compared->a.type().is_float()) return !e;
  switch (e.kind()) {
    case Kind::LT:
      return compared->b <= compared->a;
    case Kind::LE:
      return compared->b < compared->a;
    case Kind::GT:
      return compared->a <= compared->b;
    case Kind::GE:
      return compared->a < compared->b;
    case Kind::EQ:
      return compared->a != compared->b;
    case Kind::NE:
      return compared->a == compared->b;
    default:
      return !e;
  }
}

// The condition with its parts replaced; the parts are the operands of And and Or.
Expr map_parts(const Expr& condition, ExprMap map) {
  const auto* pair = condition.as<Binary>();
  if (condition.kind() == Kind::And) return both(map_parts(pair->a, map), map_parts(pair->b, map));
  if (condition.kind() == Kind::Or) return either(map_parts(pair->a, map), map_parts(pair->b, map));
  return map(condition);
}

// Whether `part` may hold for some values of the variables in the scope.
Expr for_some(const Expr& part, const Scope<Interval>& scope) {
  const auto* compared = part.as<Binary>();
  if (!compared || compared->a.type() != Int(32)) return const_true();
  const Interval difference = bounds_of(compared->a - compared->b, scope);
  const Expr zero = Expr(0);
  const auto where = [](const Expr& end, Kind kind, const Expr& zero) {
    return end.defined() ? simplify(binary(kind, end, zero)) : const_true();
  };
  switch (part.kind()) {
    case Kind::LT:
      return where(difference.min, Kind::LT, zero);
    case Kind::LE:
      return where(difference.min, Kind::LE, zero);
    case Kind::GT:
      return where(difference.max, Kind::GT, zero);
    case Kind::GE:
      return where(difference.max, Kind::GE, zero);
    case Kind::EQ:
      return both(where(difference.min, Kind::LE, zero), where(difference.max, Kind::GE, zero));
    default:
      return const_true();
  }
}

}  // namespace

Expr both(const Expr& a, const Expr& b) {
  if (is_const_true(a) || is_const_false(b) || equal(a, b)) return b;
  return is_const_true(b) || is_const_false(a) ? a : a && b;
}

Expr either(const Expr& a, const Expr& b) {
  if (is_const_false(a) || is_const_true(b) || equal(a, b)) return b;
  if (is_const_false(b) || is_const_true(a)) return a;
  const Expr result = a || b;
  return is_usable(result) ? result : const_true();
}

Expr usable_where(const Expr& condition, bool holds) {
  const auto* pair = condition.as<Binary>();
  const Kind kind = condition.kind();
  if (kind == Kind::And || kind == Kind::Or) {
    const Expr a = usable_where(pair->a, holds), b = usable_where(pair->b, holds);
    return (kind == Kind::And) == holds ? both(a, b) : either(a, b);
  }
  if (const auto* opposite = condition.as<Not>()) return usable_where(opposite->a, !holds);
  const auto* call = condition.as<Call>();
  if (call && call->is_likely()) return usable_where(call->args[0], holds);
  const Expr plain = without_likely(condition);
  if (!is_usable(plain)) return const_true();
  return holds ? plain : negation(plain);
}

Expr from_outside(const Expr& condition, const Binder& binder, AtLoops at_loops) {
  if (!uses_variable(condition, binder.name)) return condition;
  if (binder.value.defined()) {
    const Expr value = without_likely(binder.value);
    if (!is_usable(value)) return without_parts_of(condition, {binder.name});
    return map_parts(condition, [&](const Expr& part) {
      const Expr result = substitute(part, binder.name, value);
      return is_usable(result) ? result : const_true();
    });
  }
  if (at_loops == AtLoops::Forget) return without_parts_of(condition, {binder.name});
  Scope<Interval> scope;
  scope.push(binder.name, {binder.min, binder.min + binder.extent - 1});
  return map_parts(condition, [&](const Expr& part) {
    if (!uses_variable(part, binder.name)) return part;
    const Expr result = for_some(part, scope);
    return is_usable(result) ? result : const_true();
  });
}

namespace {

Expr without_parts(const Expr& condition, FunctionRef<bool(const Expr&)> drops) {
  return map_parts(condition, [&](const Expr& part) { return drops(part) ? const_true() : part; });
}

}  // namespace

Expr without_parts_of(const Expr& condition, const std::unordered_set<std::string>& names) {
  return without_parts(condition, [&](const Expr& part) { return uses_any_variable(part, names); });
}

Expr without_reads(const Expr& condition, FunctionRef<bool(const Call&)> may_read) {
  return without_parts(condition, [&](const Expr& part) {
    return any_node(part, [&](const Call& call) {
      const bool reads = call.call_type == CallType::Func || call.call_type == CallType::Image;
      return reads && !may_read(call);
    });
  });
}

Expr without_reads(const Expr& condition) {
  return without_reads(condition, [](const Call&) { return false; });
}

Expr without_calls(const Expr& condition) {
  return without_parts(condition, [](const Expr& part) {
    return any_node(part, [](const Call& call) { return call.call_type == CallType::Extern; });
  });
}

}  // namespace retrograde::lower

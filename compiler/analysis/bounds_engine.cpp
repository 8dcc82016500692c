// The walk: an expression that does not vary is its own bound, a sum is bounded as a whole
// (bounds_of_sums.cpp), and each other node, an atom, has its own rule below.
#include "analysis/bounds_engine.h"

#include <algorithm>

#include "analysis/interval_arithmetic.h"
#include "analysis/nonnegative.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::analysis {

BoundsEngine::BoundsEngine(const Scope<Interval>& variables, const ValueBounds* values)
    : shared_(std::make_shared<Shared>(Shared{values})), scope_(&variables) {}

BoundsEngine::BoundsEngine(BoundsEngine& outer)
    : shared_(outer.shared_), scope_(&outer.scope_), outer_(&outer) {}

void BoundsEngine::bind(const Let& let) {
  if (outer_) outer_->bind(let);
  if (!scope_.contains(let.name)) scope_.push(let.name, bounds(let.value));
}

bool BoundsEngine::varies(const Expr& e) {
  return varies_.get(e, [&] { return finds_varying(e); });
}

bool BoundsEngine::finds_varying(const Expr& e) {
  return match(
      e, [&](const Variable& v) { return scope_.contains(v.name); },
      [](const Load&) { return true; }, [](const Let&) { return true; },
      [&](const Call& call) {
        if (call.call_type == CallType::Func || call.call_type == CallType::Image) return true;
        if (call.op != Op::none && op_info(call.op).cls == OpClass::Effect) return true;
        return std::ranges::any_of(call.args, [&](const Expr& arg) { return varies(arg); });
      },
      [&](const ExprNode&) {
        bool any = false;
        for_each_child(e, [&](const Expr& child) { any = any || varies(child); });
        return any;
      });
}

Interval BoundsEngine::bounds(const Expr& e) {
  return memo_.get(e, [&] { return compute(e); });
}

Interval BoundsEngine::compute(const Expr& e) {
  if (const Broadcast* b = e.as<Broadcast>()) return bounds(b->value);
  if (const Ramp* ramp = e.as<Ramp>()) return ramp_bounds(*ramp);
  if (!e.type().is_scalar()) return type_range(e.type());
  if (!varies(e)) return Interval::point(canonical(e));
  if (!has_linear_form(e.type())) return atom_bounds(e);
  Sum form = join_correlated_terms(linear_form(e));
  bool is_atom = form.terms.size() == 1 && form.terms[0].atom.same_as(e);
  return is_atom ? bounds_of_atom(e) : sum_bounds(form);
}

// Atoms of linear_form are never decomposed again, so the recursion always descends.
Interval BoundsEngine::bounds_of_atom(const Expr& atom) {
  return atoms_.get(atom, [&] { return atom_bounds(atom); });
}

Interval BoundsEngine::ramp_bounds(const Ramp& ramp) {
  Type type = ramp.type.element_of();
  Interval last =
      interval_mul(type, bounds(ramp.stride), Interval::point(make_const(type, ramp.lanes - 1)));
  Interval base = bounds(ramp.base);
  return hull(base, interval_add(type, base, last));
}

Interval BoundsEngine::atom_bounds(const Expr& e) {
  return match(
      e,
      [&](const Variable& v) {
        const Interval* interval = scope_.find(v.name);
        return interval ? *interval : Interval::point(e);
      },
      [&](const Cast& n) { return cast_bounds(n.type, n.value); },
      [&](const Binary& n) { return binary_bounds(e, n); },
      [&](const Select& n) { return select_bounds(n.condition, n.when_true, n.when_false); },
      [&](const Call& n) { return call_bounds(n); },
      [&](const Let& n) {
        bind(n);
        return bounds(n.body);
      },
      [&](const Not& n) {
        Truth value = truth(n.a);
        if (value == Truth::Unknown) return type_range(n.type);
        return Interval::point(make_const(n.type, value == Truth::False));
      },
      [&](const ExprNode& n) { return type_range(n.type); });
}

// For int(abs(a)), symbolic ends of the unsigned value in between do not determine the sign.
Interval BoundsEngine::cast_bounds(Type type, const Expr& value) {
  const auto* call = value.as<Call>();
  if (call && call->is_op(Op::abs, Op::absd) && call->args[0].type() == type && type.is_int()) {
    return call->is_op(Op::abs)
               ? interval_abs(type, type, bounds(call->args[0]))
               : interval_absd(type, type, bounds(call->args[0]), bounds(call->args[1]));
  }
  Interval v = bounds(value);
  if (!value.type().is_float() || v.min.defined() || !is_nonnegative_or_nan(value))
    return interval_cast(type, value.type(), v);
  if (v.max.defined()) return interval_cast(type, value.type(), {make_zero(value.type()), v.max});
  // Where it may be NaN too, the integer is kept from being negative
  // (lower/definitions/strict_indices.h).
  Interval result = type_range(type);
  if (has_linear_form(type)) result.min = make_zero(type);
  return result;
}

Interval BoundsEngine::binary_bounds(const Expr& e, const Binary& op) {
  Type type = op.a.type();
  switch (e.kind()) {
    case Kind::Add:
      return interval_add(type, bounds(op.a), bounds(op.b));
    case Kind::Sub:
      return interval_sub(type, bounds(op.a), bounds(op.b));
    case Kind::Mul:
      return interval_mul(type, bounds(op.a), bounds(op.b));
    case Kind::Div:
      return interval_div(type, bounds(op.a), bounds(op.b));
    case Kind::Mod:
      return interval_mod(type, bounds(op.a), bounds(op.b));
    case Kind::Min:
      return interval_min(bounds(op.a), bounds(op.b));
    case Kind::Max:
      return interval_max(bounds(op.a), bounds(op.b));
    default: {
      Truth value = truth(e);
      if (value == Truth::Unknown) return type_range(e.type());
      return Interval::point(make_const(e.type(), value == Truth::True));
    }
  }
}

Interval BoundsEngine::select_bounds(const Expr& condition, const Expr& when_true,
                                     const Expr& when_false) {
  Truth decided = truth(condition);
  if (decided == Truth::True) return bounds(when_true);
  if (decided == Truth::False) return bounds(when_false);
  return hull(under(condition, true).bounds(when_true), under(condition, false).bounds(when_false));
}

}  // namespace retrograde::analysis

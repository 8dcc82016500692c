// Casts, vectors, operators and lets.
#include <algorithm>
#include <memory>

#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplifier.h"

namespace retrograde::simplification {

// ---- casts ----

Expr Simplifier::cast(Type type, const Expr& value) {
  if (const auto* splat = value.as<Broadcast>(); splat && !is_const(value)) {
    return broadcast(cast(type.with_lanes(splat->value.type().lanes()), splat->value),
                     splat->lanes);
  }
  const Type from = value.type();
  if (const auto* line = value.as<Ramp>();
      line && is_index_type(from) && is_index_type(type) && type.bits() > from.bits()) {
    const Type lane = type.with_lanes(line->base.type().lanes());
    return ramp(cast(lane, line->base), cast(lane, line->stride), line->lanes);
  }
  if (const auto* inner = value.as<Cast>()) {
    const Type origin = inner->value.type();
    // The inner cast preserves every value, so it is dropped. (Exactly one rounding remains.)
    if (!from.is_bool() && from.can_represent(origin) && (from.is_float() || !type.is_bool())) {
      return cast(type, inner->value);
    }
    // Integers wrap to the narrower type in one step as in two.
    const bool integers = origin.is_int_or_uint() && from.is_int_or_uint() && type.is_int_or_uint();
    const bool no_bools = !origin.is_bool() && !from.is_bool() && !type.is_bool();
    if (integers && no_bools && type.bits() <= from.bits()) return cast(type, inner->value);
  }
  return cast_to(type, value);
}

// ---- vectors ----

Expr Simplifier::ramp(const Expr& base, const Expr& stride, int lanes) {
  if (lanes == 1) return base;
  return base.type().is_scalar() && is_zero(stride) && stride.type().is_int_or_uint()
             ? broadcast(base, lanes)
             : make_ramp(base, stride, lanes);
}

Expr Simplifier::broadcast(const Expr& value, int lanes) { return make_broadcast(value, lanes); }

// One operation on equal lanes becomes a scalar operation.
Expr Simplifier::distribute_broadcast(Kind kind, const Expr& a, const Expr& b) {
  const auto* x = a.as<Broadcast>();
  const auto* y = b.as<Broadcast>();
  if (!x || !y || x->lanes != y->lanes || (is_const(a) && is_const(b))) return {};
  return broadcast(apply(kind, x->value, y->value), x->lanes);
}

namespace {

// Whether a mask holds in any lane, if one lane decides: for x + i s < y the first or the last.
Expr holds_anywhere(const Expr& mask) {
  const auto* op = mask.as<Binary>();
  if (!op) return {};
  const auto *a = op->a.as<Broadcast>(), *b = op->b.as<Broadcast>();
  if (mask.kind() == Kind::And && (a || b)) {
    const Expr& one = a ? a->value : b->value;
    return one.type().is_scalar()
               ? binary(Kind::And, one, make_vector_reduce(Kind::Or, a ? op->b : op->a, 1))
               : Expr();
  }
  if (mask.kind() != Kind::LT && mask.kind() != Kind::LE) return {};
  const auto* ramp = (b ? op->a : op->b).as<Ramp>();
  const Expr other = b ? b->value : a ? a->value : Expr();
  if (!ramp || !other.defined() || !other.type().is_scalar() || !ramp->base.type().is_scalar())
    return {};
  const auto stride = as_const_int(ramp->stride);
  const Type type = other.type();
  if (!stride || !type.is_int() || type.bits() < 32) return {};
  const int64_t reach = *stride * (ramp->lanes - 1), least = std::min<int64_t>(reach, 0);
  const Expr end = ramp->base + make_const(type, b ? least : reach - least);
  return b ? binary(mask.kind(), end, other) : binary(mask.kind(), other, end);
}

}  // namespace

Expr Simplifier::vector_reduce(const VectorReduce& n) {
  Expr value = (*this)(n.value);
  if (n.op == Kind::Or && n.type.is_scalar()) {
    if (const Expr one = holds_anywhere(value); one.defined()) return (*this)(one);
  }
  const auto* splat = value.as<Broadcast>();
  const bool idempotent = n.op != Kind::Add && n.op != Kind::Mul;
  if (splat && splat->value.type().is_scalar()) {
    if (idempotent) return broadcast(splat->value, n.type.lanes());
    if (n.op == Kind::Add && has_sums(n.type)) {
      const int group = n.value.type().lanes() / n.type.lanes();
      return broadcast(
          apply(Kind::Mul, splat->value, make_const(splat->value.type(), int64_t{group})),
          n.type.lanes());
    }
  }
  return make_vector_reduce(n.op, std::move(value), n.type.lanes());
}

// ---- operators ----

namespace {

bool is_pure_operator(const Call& n) {
  return n.call_type == CallType::Operator && op_info(n.op).cls == OpClass::Pure;
}

// The scalar arguments of a vector operator whose arguments are all broadcasts of scalars.
std::vector<Expr> scalar_arguments(const std::vector<Expr>& args) {
  std::vector<Expr> scalars;
  for (const Expr& arg : args) {
    const auto* splat = arg.as<Broadcast>();
    if (!splat || !splat->value.type().is_scalar()) return {};
    scalars.push_back(splat->value);
  }
  return scalars;
}

// x when e is op(x, 0) or another identity.
Expr bit_identity(Op op, const std::vector<Expr>& args) {
  switch (op) {
    case Op::bitwise_or:
    case Op::bitwise_xor:
      return is_zero(args[1]) ? args[0] : is_zero(args[0]) ? args[1] : Expr();
    case Op::bitwise_and:
      return is_zero(args[1]) ? args[1] : is_zero(args[0]) ? args[0] : Expr();
    case Op::shift_left:
    case Op::shift_right:
      return is_zero(args[1]) || is_zero(args[0]) ? args[0] : Expr();
    default:
      return {};
  }
}

}  // namespace

Expr Simplifier::call(const Expr& e, const Call& n) {
  bool changed = false;
  std::vector<Expr> args;
  for (const Expr& arg : n.args) {
    args.push_back((*this)(arg));
    changed |= !args.back().same_as(arg);
  }
  if (n.call_type != CallType::Operator) {
    return changed ? Expr(make_node<Call>(n.type, n.call_type, n.op, n.name, std::move(args),
                                          n.component, n.symbol))
                   : e;
  }
  if (n.op == Op::if_then_else && is_const(args[0]))
    return is_const_true(args[0]) ? args[1] : args[2];
  const bool hint = n.is_likely();
  if (hint && is_const(args[0])) return args[0];
  if (hint && args[0].kind() == Kind::Call && args[0].as<Call>()->is_op(n.op)) return args[0];
  const bool promise = n.op == Op::promise_clamped || n.op == Op::unsafe_promise_clamped;
  if (promise && args[0].type().is_int_or_uint()) {  // kept only while it adds information
    if (is_const(args[0])) return args[0];
    const Expr inside =
        apply(Kind::And, apply(Kind::LE, args[1], args[0]), apply(Kind::LE, args[0], args[2]));
    if (is_const_true(inside)) return args[0];
  }
  if (is_pure_operator(n)) {
    if (Expr same = bit_identity(n.op, args); same.defined()) return same;
    if (n.type.is_vector()) {
      std::vector<Expr> scalars = scalar_arguments(args);
      if (!scalars.empty())
        return broadcast(call_op(n.op, n.type.element_of(), std::move(scalars)), n.type.lanes());
    }
  }
  return changed ? call_op(n.op, n.type, std::move(args)) : e;
}

// ---- lets ----

bool is_trivial_value(const Expr& e) {
  if (is_const(e) || e.kind() == Kind::Variable) return true;
  if (e.kind() == Kind::Add || e.kind() == Kind::Sub) {  // x + 3
    const auto* n = e.as<Binary>();
    return e.type().is_int() && n->a.kind() == Kind::Variable && is_const(n->b);
  }
  if (const auto* splat = e.as<Broadcast>()) return is_trivial_value(splat->value);
  if (const auto* line = e.as<Ramp>())
    return is_trivial_value(line->base) && is_const(line->stride);
  return false;
}

// Nested lets are handled in a loop: their depth is not bounded by the C++ stack.
Expr Simplifier::let(const Expr& e) {
  Lets kept;
  std::vector<std::unique_ptr<Binding>> bindings;
  Expr body = e;
  while (const auto* n = body.as<Let>()) {
    Expr value = (*this)(n->value);
    const bool trivial = is_trivial_value(value);
    bindings.push_back(
        std::make_unique<Binding>(*this, n->name, value, value, trivial ? value : Expr()));
    if (!trivial) kept.emplace_back(n->name, value);
    body = n->body;
  }
  Expr result = (*this)(body);
  while (!bindings.empty()) bindings.pop_back();
  for (auto it = kept.rbegin(); it != kept.rend(); ++it) {
    const auto* var = result.as<Variable>();
    result = var && var->name == it->first ? it->second
                                           : make_let(it->first, it->second, std::move(result));
  }
  return drop_dead_lets(result);
}

bool has_effect(const Expr& e) {
  return any_node(
      e, [&](const Call& call) { return call.call_type == CallType::Extern || acts(call.op); });
}

}  // namespace retrograde::simplification

#include "autodiff/sweeps/local_derivative.h"

#include <cmath>

#include "autodiff/rules/stable_forms.h"
#include "autodiff/rules/value_range.h"
#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::autodiff {

namespace {

bool makes_risky(const Expr& e) {
  const auto* call = e.as<Call>();
  const auto* constant = e.as<FloatImm>();
  return (constant && !std::isfinite(constant->value)) ||
         (e.kind() == Kind::Div && e.type().is_float()) ||
         (call && (call->call_type == CallType::Extern ||
                   (call->call_type == CallType::Operator && is_risky_op(call->op))));
}

// Visits the operands that decide whether the value is finite. Integers are finite, and so is a select between finite
// values, whatever its condition.
void for_each_operand(const Expr& e, ExprVisit visit) {
  const auto* cast = e.as<Cast>();
  if (cast && !cast->value.type().is_float()) return;
  if (const auto* choice = e.as<Select>()) {
    visit(choice->when_true);
    visit(choice->when_false);
  } else if (const auto* call = as_op(e, Op::if_then_else)) {
    visit(call->args[1]);
    visit(call->args[2]);
  } else if (!is_leaf(e)) {
    for_each_child(e, visit);
  }
}

// A derivative of 1: the value is the operand's, whatever the types.
LocalDerivative same_as(const Expr& e, const Expr& operand) {
  LocalDerivative result{LocalDerivative::Kind::Sum, {operand}, {}, {}, {}, {{}}};
  result.partials.push_back({make_one(adjoint_type(e.type())), Strength::Plain});
  return result;
}

LocalDerivative sum_of(const std::vector<Expr>& operands, std::vector<Partial> partials,
                       const ExprFacts& facts) {
  LocalDerivative result{LocalDerivative::Kind::Sum, operands, std::move(partials), {}, {}, {}};
  result.partials.resize(operands.size());
  for (Partial& p : result.partials) {
    Finiteness partial;
    for (const Expr& part : {p.factor, p.divisor}) {
      if (part.defined()) partial.add(facts.finiteness_of(part));
    }
    if (partial.risky) p.strength = as_strong(p.strength);
    partial.risky |= p.divisor.defined();
    result.factors.push_back(partial);
  }
  return result;
}

// Whether `e` is a quotient whose divisor may be infinite; the value is 0 there.
bool is_quotient(const Expr& e) {
  const auto* quotient = e.as<Div>();
  return quotient && e.type().is_float() && !is_const(quotient->b);
}

LocalDerivative choice_of(const Expr& condition, const Expr& a, const Expr& b) {
  return {LocalDerivative::Kind::Choice, {a, b}, {}, condition, {}, {}};
}

LocalDerivative of_call(const Expr& e, const Call& call, const ExprFacts& facts) {
  if (call.is_op(Op::if_then_else)) return choice_of(call.args[0], call.args[1], call.args[2]);
  if (call.call_type == CallType::Extern) {
    unsupported(text("differentiate the call of the C function ", quoted(call.name)),
                "a C function has no known derivative",
                "the gradient of one of its arguments is wanted",
                text("wrap the argument in stop_gradient, write ", quoted(call.name),
                     " in the language, or give the Func that calls it a custom_adjoint"));
  }
  const DerivativeRule& rule = derivative_rule(call.op);
  const char* name = op_info(call.op).name;
  LocalDerivative zero, smooth;
  switch (rule.cls) {
    case RuleClass::Smooth:
      smooth = sum_of(call.args, rule.partials(call.args, e), facts);
      smooth.poles = has_poles(call);
      for (Finiteness& factor : smooth.factors) factor.risky |= is_risky_op(call.op);
      smooth.levels_off.assign(call.args.size(), levels_off(call.op));
      return smooth;
    case RuleClass::Transparent:
      return same_as(e, call.args[static_cast<size_t>(rule.transparent_arg)]);
    case RuleClass::Constant:
    case RuleClass::Blocked:
      zero.note = text(name, " has derivative 0 (", rule.convention, ")");
      return zero;
    case RuleClass::NoRule:
      break;
  }
  unsupported(text("differentiate ", name), rule.convention);
}

}  // namespace

std::vector<Expr> post_order(const std::vector<Expr>& roots) {
  std::vector<Expr> order;
  std::unordered_set<const ExprNode*> seen;
  std::vector<std::pair<Expr, bool>> stack;  // explicit, because users' DAGs can be deep
  for (auto root = roots.rbegin(); root != roots.rend(); ++root) {
    if (root->defined()) stack.emplace_back(*root, false);
  }
  while (!stack.empty()) {
    auto [e, children_done] = stack.back();
    stack.pop_back();
    if (children_done) {
      order.push_back(e);
    } else if (seen.insert(e.get()).second) {
      stack.emplace_back(e, true);
      for_each_child(e, [&](const Expr& child) { stack.emplace_back(child, false); });
    }
  }
  return order;
}

bool is_leaf(const Expr& e) {
  const auto* call = e.as<Call>();
  return e.as<Variable>() ||
         (call && (call->call_type == CallType::Func || call->call_type == CallType::Image));
}

ExprFacts::ExprFacts(const std::vector<Expr>& order, FunctionRef<bool(const Expr&)> is_wanted,
                     const ValueRanges& ranges) {
  for (const Expr& e : order) classify(e, is_wanted, ranges);
}

void ExprFacts::classify(const Expr& e, FunctionRef<bool(const Expr&)> is_wanted,
                         const ValueRanges& ranges) {
  const bool floating = e.type().is_float();
  bool active = false;
  Finiteness own{.risky = makes_risky(e)};
  for_each_operand(e, [&](const Expr& operand) { own.add(classified_.at(operand.get())); });
  if (is_leaf(e)) {
    active = floating && is_wanted(e);
    own = {.read = e.as<Variable>() == nullptr && !ranges.is_promised_finite(e),
           .infinite = floating && ranges.may_be_infinite(e)};
  } else {
    for_each_child(e, [&](const Expr& child) { active |= is_active(child); });
    if (active && !floating) {  // derivatives pass through floating-point values only
      if (e.as<Cast>()) notes_.insert("a cast to " + to_string(e.type()) + " has derivative 0");
      active = false;
    }
  }
  const auto* product = e.as<Mul>();
  own.product |= product && floating && classified_.at(product->a.get()).read &&
                 classified_.at(product->b.get()).read;
  if (const auto* div = e.as<Div>(); div && is_const(div->b))
    own.risky = classified_.at(div->a.get()).risky;
  classified_[e.get()] = own;
  if (active) active_.insert(e.get());
}

Finiteness ExprFacts::finiteness_of(const Expr& factor) const {
  Finiteness result;
  std::unordered_set<const ExprNode*> seen;
  std::vector<Expr> open{factor};
  while (!open.empty()) {
    const Expr e = open.back();
    open.pop_back();
    if (!seen.insert(e.get()).second) continue;
    auto known = classified_.find(e.get());
    if (known != classified_.end()) {
      result.add(known->second);
    } else {
      const auto* constant = e.as<FloatImm>();
      result.risky |= constant && !std::isfinite(constant->value);
      for_each_operand(e, [&](const Expr& operand) { open.push_back(operand); });
    }
  }
  return result;
}

LocalDerivative local_derivative(const Expr& e, const ExprFacts& facts) {
  if (StableForm form = stable_form(e); !form.operands.empty()) {
    LocalDerivative sum = sum_of(form.operands, form.partials, facts);
    const auto* call = e.as<Call>();
    sum.levels_off.assign(sum.operands.size(), call ? levels_off(call->op) : is_quotient(e));
    return sum;
  }
  return match(
      e, [&](const Select& s) { return choice_of(s.condition, s.when_true, s.when_false); },
      [&](const Cast& c) { return same_as(e, c.value); },
      [&](const Broadcast&) -> LocalDerivative {
        internal_error("vectors have no place in the definition of a Func");
      },
      [&](const Binary& b) {
        LocalDerivative sum =
            sum_of({b.a, b.b}, derivative_rule(e.kind()).partials({b.a, b.b}, e), facts);
        sum.levels_off = {false, is_quotient(e)};
        return sum;
      },
      [&](const Call& call) { return of_call(e, call, facts); },
      [&](const ExprNode& node) -> LocalDerivative {
        if (!has_derivative_rule(node.kind))
          internal_error(text("no derivative of a ", kind_name(node.kind)));
        unsupported(text("differentiate ", kind_name(node.kind)),
                    derivative_rule(node.kind).convention);
      });
}

AdjointTraits traits_of(const Expr& adjoint) {
  AdjointTraits result;
  Expr top = adjoint;
  while (const auto* cast = top.as<Cast>()) top = cast->value;
  bool is_seed = is_leaf(top) && top.as<Call>();
  walk(adjoint, [&](const Expr& e) {
    result.masked |= e.type().is_float() && e.as<Select>();
    result.vanished |= is_quotient(e);
    const auto* call = e.as<Call>();
    if (!call) return true;
    const bool is_operator = call->call_type == CallType::Operator;
    result.singular |= is_operator && has_poles(*call);
    result.vanished |= is_operator && levels_off(call->op);
    const Provenance* provenance = provenance_of(*call);
    if (provenance) result.add(provenance->traits);
    if (provenance && e.same_as(top)) is_seed = false;
    return true;
  });
  result.masked |= is_seed;
  return result;
}

}  // namespace retrograde::autodiff

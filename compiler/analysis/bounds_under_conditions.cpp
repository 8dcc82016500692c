// Conditions: whether bounds decide one, and the bounds of variables where it holds.
#include "analysis/bounds_engine.h"
#include "analysis/interval_arithmetic.h"
#include "ir/build.h"

namespace retrograde::analysis {

namespace {

BoundsEngine::Truth negated(BoundsEngine::Truth t) {
  using Truth = BoundsEngine::Truth;
  return t == Truth::Unknown ? t : t == Truth::True ? Truth::False : Truth::True;
}

}  // namespace

BoundsEngine::Truth BoundsEngine::truth(const Expr& condition) {
  if (is_const_true(condition)) return Truth::True;
  if (is_const_false(condition)) return Truth::False;
  if (!condition.type().is_scalar()) return Truth::Unknown;
  if (const Not* n = condition.as<Not>()) return negated(truth(n->a));
  if (const Call* call = condition.as<Call>())
    return call->is_marker() ? truth(call->args[0]) : Truth::Unknown;
  const Binary* op = condition.as<Binary>();
  if (!op) return Truth::Unknown;
  if (condition.kind() == Kind::And || condition.kind() == Kind::Or) {
    Truth decisive = condition.kind() == Kind::And ? Truth::False : Truth::True;
    Truth a = truth(op->a), b = truth(op->b);
    if (a == decisive || b == decisive) return decisive;
    return a == b ? a : Truth::Unknown;
  }
  return compare_truth(condition.kind(), op->a, op->b);
}

BoundsEngine::Truth BoundsEngine::compare_truth(Kind kind, const Expr& a, const Expr& b) {
  if (kind == Kind::GT || kind == Kind::GE)
    return compare_truth(kind == Kind::GT ? Kind::LT : Kind::LE, b, a);
  if (kind == Kind::NE) return negated(compare_truth(Kind::EQ, a, b));
  if (a.type().is_bool() || !a.type().is_int_or_uint()) return Truth::Unknown;
  std::optional<int64_t> low, high;  // of a - b
  if (has_linear_form(a.type())) {
    Interval d = sum_bounds(join_correlated_terms(plus(linear_form(a), linear_form(b), -1)));
    low = constant_min(d);
    high = constant_max(d);
  } else if (a.type().bits() < 64) {
    Interval x = bounds(a), y = bounds(b);
    auto difference = [](auto p, auto q) {
      return p && q ? std::optional<int64_t>(*p - *q) : std::nullopt;
    };
    low = difference(constant_min(x), constant_max(y));
    high = difference(constant_max(x), constant_min(y));
  }
  if (kind == Kind::EQ) {
    if (low && high && *low == 0 && *high == 0) return Truth::True;
    return (low && *low > 0) || (high && *high < 0) ? Truth::False : Truth::Unknown;
  }
  int64_t limit = kind == Kind::LT ? -1 : 0;  // the comparison means a - b <= limit
  if (high && *high <= limit) return Truth::True;
  return low && *low > limit ? Truth::False : Truth::Unknown;
}

BoundsEngine& BoundsEngine::under(const Expr& condition, bool is_true) {
  for (const Child& child : children_) {
    if (child.condition.same_as(condition) && child.is_true == is_true)
      return child.engine ? *child.engine : *this;
  }
  if (shared_->engines_left <= 0) return *this;
  children_.push_back({condition, is_true, nullptr});
  size_t index = children_.size() - 1;
  Narrowed narrowed;
  narrow(condition, is_true, narrowed);
  if (narrowed.variables.empty()) return *this;
  --shared_->engines_left;
  std::unique_ptr<BoundsEngine> child(new BoundsEngine(*this));
  for (auto& [name, interval] : narrowed.variables) child->scope_.push(name, interval);
  child->facts_ = std::move(narrowed.facts);
  children_[index].engine = std::move(child);
  return *children_[index].engine;
}

void BoundsEngine::narrow(const Expr& condition, bool is_true, Narrowed& narrowed) {
  if (!condition.type().is_scalar()) return;
  if (const Not* n = condition.as<Not>()) return narrow(n->a, !is_true, narrowed);
  if (const Call* call = condition.as<Call>()) {
    if (call->is_likely()) narrow(call->args[0], is_true, narrowed);
    bool is_lazy_and = call->is_op(Op::if_then_else) && is_const_false(call->args[2]);
    for (int i = 0; is_lazy_and && is_true && i < 2; ++i) narrow(call->args[i], true, narrowed);
    return;
  }
  const Binary* op = condition.as<Binary>();
  if (!op) return;
  Kind kind = condition.kind();
  if (kind == Kind::And || kind == Kind::Or) {
    if (is_true != (kind == Kind::And)) return;  // a disjunction implies neither operand
    narrow(op->a, is_true, narrowed);
    narrow(op->b, is_true, narrowed);
  } else if (is_true) {
    narrow_by_comparison(kind, op->a, op->b, narrowed);
  } else if (kind == Kind::LT || kind == Kind::LE) {  // !(a < b) is b <= a
    narrow_by_comparison(kind == Kind::LT ? Kind::LE : Kind::LT, op->b, op->a, narrowed);
  } else if (kind == Kind::GT || kind == Kind::GE) {
    narrow_by_comparison(kind == Kind::GT ? Kind::LE : Kind::LT, op->a, op->b, narrowed);
  } else if (kind == Kind::NE) {
    narrow_by_comparison(Kind::EQ, op->a, op->b, narrowed);
  }
}

void BoundsEngine::narrow_by_comparison(Kind kind, const Expr& a, const Expr& b,
                                        Narrowed& narrowed) {
  if (!has_linear_form(a.type())) return;
  Sum d = plus(linear_form(a), linear_form(b), -1);
  Sum reversed = times(d, -1);
  switch (kind) {
    case Kind::LT:
      d.add_constant(1);
      return narrow_nonpositive(d, narrowed);
    case Kind::LE:
      return narrow_nonpositive(d, narrowed);
    case Kind::GT:
      reversed.add_constant(1);
      return narrow_nonpositive(reversed, narrowed);
    case Kind::GE:
      return narrow_nonpositive(reversed, narrowed);
    case Kind::EQ:
      narrow_nonpositive(d, narrowed);
      return narrow_nonpositive(reversed, narrowed);
    default:
      return;
  }
}

// form <= 0 bounds each variable v of the scope in it: c*v <= -rest, and -rest <= -(min of rest).
void BoundsEngine::narrow_nonpositive(const Sum& form, Narrowed& narrowed) {
  if (!form.valid) return;
  size_t loose = 0;
  for (const Term& term : form.terms) {
    const Variable* v = term.atom.as<Variable>();
    const Interval* old = v ? scope_.find(v->name) : nullptr;
    if (!old) continue;
    ++loose;
    Sum rest = plus(form, linear_form(term.atom), -term.factor);
    Expr least = sum_bounds(join_correlated_terms(rest)).min;
    if (!least.defined()) continue;
    int64_t c = term.factor;
    Sum limit = linear_form(least);  // c*v + limit <= 0
    Interval implied;
    if (c > 0) {
      Expr numerator = to_expr(times(limit, -1));
      if (numerator.defined()) implied.max = canonical_div(numerator, c);
    } else {  // v >= limit / |c|, rounded up
      limit.add_constant(-c - 1);
      Expr numerator = to_expr(limit);
      if (numerator.defined()) implied.min = canonical_div(numerator, -c);
    }
    narrowed.variables[v->name] =
        intersection(value_or(narrowed.variables, v->name, *old), implied);
  }
  if (loose > 1) narrowed.facts.push_back(form);
}

}  // namespace retrograde::analysis

// Sums are decomposed into linear form first, so that a variable that occurs twice counts once.
// Each atom of the sum has its own rule below. An expression that does not vary is its own bound.
#include "analysis/bounds_engine.h"

#include <algorithm>
#include <cmath>

#include "analysis/interval_arithmetic.h"
#include "analysis/nonnegative.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/join_clamps.h"
#include "ir/scalar.h"
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

Interval BoundsEngine::sum_bounds(const Sum& form) {
  if (!form.valid) return Interval::everything();
  const std::optional<Interval> known = bounds_by_facts(form);
  if (known) return *known;
  const std::optional<Interval> apart = bounds_by_distribution(form);
  return apart ? *apart : sum_of_bounds(form);
}

// Collects the varying atoms of a sum with their signs. It looks into both sides of minima and
// maxima, and into dividends, of which a remainder may be left. Nested minima repeat their sides,
// so the number is limited.
void BoundsEngine::collect_varying(const Sum& form, bool negated,
                                   std::vector<std::pair<Expr, bool>>& found) {
  for (const Term& term : form.terms) {
    const Expr& atom = term.atom;
    if (found.size() >= most_varying || !varies(atom)) continue;
    const bool negative = (term.factor < 0) != negated;
    if (atom.kind() == Kind::Min || atom.kind() == Kind::Max) {
      const auto& op = *atom.as<Binary>();
      collect_varying(linear_form(op.a), negative, found);
      collect_varying(linear_form(op.b), negative, found);
    } else if (const Div* div = atom.as<Div>(); div && as_const_int(div->b).value_or(0) > 0) {
      collect_varying(linear_form(div->a), negative, found);
    } else {
      found.emplace_back(atom, negative);
    }
  }
}

// Whether both contain a varying atom that partly cancels in their sum.
bool BoundsEngine::may_cancel(const Sum& rest, const Sum& side, int64_t factor) {
  std::vector<std::pair<Expr, bool>> of_rest, of_side;
  collect_varying(side, factor < 0, of_side);
  if (of_side.empty()) return false;
  collect_varying(rest, false, of_rest);
  return std::ranges::any_of(of_side, [&](const auto& part) {
    return std::ranges::any_of(of_rest, [&](const auto& other) {
      return other.second != part.second && other.first.same_as(part.first);
    });
  });
}

// 16*x + 8*min(d - 2*x, 1)  is  min(8*d, 16*x + 8): bounding x and the minimum separately would be
// too wide. The same holds for max. Each step removes one minimum or maximum, and doubles the work,
// so the number of steps is limited.
std::optional<Interval> BoundsEngine::bounds_by_distribution(const Sum& form) {
  for (const Term& term : form.terms) {
    const Expr& atom = term.atom;
    if (atom.kind() != Kind::Min && atom.kind() != Kind::Max) continue;
    const auto& op = *atom.as<Binary>();
    const Sum rest = plus(form, linear_form(atom), -term.factor);
    const Sum a = linear_form(op.a), b = linear_form(op.b);
    if (!rest.valid || !a.valid || !b.valid || distributions_ >= most_distributions) continue;
    if (!may_cancel(rest, a, term.factor) && !may_cancel(rest, b, term.factor)) continue;
    ++distributions_;
    const Interval x = sum_bounds(join_correlated_terms(plus(rest, a, term.factor)));
    const Interval y = sum_bounds(join_correlated_terms(plus(rest, b, term.factor)));
    --distributions_;
    const bool is_least = (atom.kind() == Kind::Min) == (term.factor > 0);
    return is_least ? interval_min(x, y) : interval_max(x, y);
  }
  return std::nullopt;
}

// If x + y <= 29 is known, x + y + z is at most 29 + z. The separate ends of x and y, 29 - y and 29
// - x, would give a wider range once the loops over x and y are eliminated.
std::optional<Interval> BoundsEngine::bounds_by_facts(const Sum& form) {
  std::optional<Interval> result;
  for (const Sum& fact : facts_) {
    if (!(fact.type == form.type)) continue;
    const Sum below = plus(form, fact, -1), above = plus(form, fact);  // form <= below
    const size_t left = form.terms.size() - std::min(form.terms.size(), fact.terms.size());
    const bool is_below = below.terms.size() == left, is_above = above.terms.size() == left;
    if (form.terms.size() < fact.terms.size() || (!is_below && !is_above)) continue;
    if (!result) result = outer_->sum_bounds(form);
    Interval implied;
    if (is_below) implied.max = outer_->sum_bounds(below).max;
    if (is_above) implied.min = outer_->sum_bounds(above).min;
    result = intersection(*result, implied);
  }
  return result;
}

// Adds the ends term by term; the part that does not vary is added to both.
Interval BoundsEngine::sum_of_bounds(const Sum& form) {
  Sum fixed = linear_sum(form.type, form.constant);
  std::vector<std::pair<Interval, int64_t>> varying;
  for (const Term& term : form.terms) {
    if (varies(term.atom)) {
      varying.emplace_back(bounds_of_atom(term.atom), term.factor);
    } else {
      fixed = plus(fixed, linear_form(term.atom), term.factor);
    }
  }
  auto end = [&](bool upper) -> Expr {
    Sum sum = fixed;
    for (const auto& [interval, coefficient] : varying) {
      const Expr& part = upper == (coefficient > 0) ? interval.max : interval.min;
      if (!part.defined()) return {};
      sum = plus(sum, linear_form(part), coefficient);
    }
    return to_expr(sum);
  };
  Interval result{end(false), end(true)};
  // Equal ends share one handle, so that is_point() holds.
  if (result.is_bounded() && constant_difference(result.min, result.max) == 0)
    result.max = result.min;
  return result;
}

namespace {

Expr canonical_cut(Kind kind, const Expr& a, const Expr& b) {
  return kind == Kind::Min ? canonical_min(a, b) : canonical_max(a, b);
}

}  // namespace

// Joins correlated terms. c*y - c*k*(y / k)  is  c*(y % k). The same holds for a varying part of y:
// a + k*((b - a) / k), the start of the last tile, is  b - (b - a) % k  for any a. The difference
// of two clamps of one value becomes one clamp.
Sum BoundsEngine::join_correlated_terms(Sum form) {
  for (const Term& term : std::vector<Term>(form.terms)) {
    const Div* div = term.atom.as<Div>();
    auto k = div ? as_const_int(div->b) : std::nullopt;
    if (!k || *k <= 0 || term.factor % *k != 0) continue;
    int64_t c = -term.factor / *k;
    Sum y = linear_form(div->a);
    bool contains_all = !y.terms.empty(), contains_varying = false;
    for (const Term& part : y.terms) {
      const bool found = std::ranges::any_of(form.terms, [&](const Term& t) {
        return t.atom.same_as(part.atom) && t.factor == __int128{c} * part.factor;
      });
      contains_all &= found;
      contains_varying |= found && varies(part.atom);
    }
    if (!contains_all && !contains_varying) continue;
    form = plus(form, y, -c);
    form = plus(form, linear_form(term.atom), -term.factor);
    form = plus(form, linear_form(binary(Kind::Mod, div->a, div->b)), c);
  }
  while (join_clamps(form, canonical_cut)) {
  }
  return form;
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

// ---- conditions ----

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

// ---- calls ----

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

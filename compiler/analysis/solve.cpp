// Solves a condition for one variable. Every comparison of integers becomes "form <= 0". Inner
// variables are replaced by the end of their interval that maximises the form. The remaining form
// is solved for the variable, atom by atom:
//
//   c*v + rest <= 0,  c > 0         v <= floor(-rest / c)
//   c*v + rest <= 0,  c < 0         v >= ceil(rest / -c)
//   c*max(p, q) + rest, c > 0       both forms with p and with q      (min with c < 0 alike)
//   c*min(p, q) + rest, c > 0       one of the two suffices           (max with c < 0 alike)
//   c*(p / k) + rest, c > 0, k > 0  p <= k*floor(-rest / c) + k - 1
//   c*(p / k) + rest, c < 0, k > 0  p >= k*ceil(rest / -c)
//   c*((min(p, q) + r) / k) + rest  where v is also in rest: both forms or one of them, with p and with q
//   c*atom + rest                   the atom's largest value, if bounded independently of v
#include <algorithm>
#include <utility>

#include "analysis/bounds_engine.h"
#include "analysis/linear.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::analysis {

namespace {

constexpr int most_levels = 8;  // of nested min, max and division; each level may try two forms

Sum without(const Sum& form, const Term& term) {
  return plus(form, linear_form(term.atom), -term.factor);
}

Sum with_replaced(const Sum& form, const Term& term, const Expr& replacement) {
  return plus(without(form, term), linear_form(replacement), term.factor);
}

class Solver {
 public:
  Solver(const std::string& variable, const Scope<Interval>& inner)
      : variable_(variable), engine_(inner, nullptr) {}

  std::optional<Solution> solve(const Expr& condition, bool is_true) {
    if (is_const_true(condition)) return is_true ? anywhere() : std::nullopt;
    if (is_const_false(condition)) return is_true ? std::nullopt : anywhere();
    if (!condition.type().is_scalar()) return std::nullopt;
    if (const Not* n = condition.as<Not>()) return solve(n->a, !is_true);
    if (const Call* call = condition.as<Call>())
      return call->is_marker() ? solve(call->args[0], is_true) : if_fixed(condition, is_true);
    const Binary* op = condition.as<Binary>();
    if (!op) return if_fixed(condition, is_true);
    if (condition.kind() == Kind::And || condition.kind() == Kind::Or) {
      bool needs_both = is_true == (condition.kind() == Kind::And);
      auto a = solve(op->a, is_true), b = solve(op->b, is_true);
      return needs_both ? all_of(a, b) : one_of(a, b);
    }
    if (!has_linear_form(op->a.type())) return if_fixed(condition, is_true);
    return solve_comparison(condition.kind(), op->a, op->b, is_true);
  }

 private:
  static std::optional<Solution> anywhere() { return Solution{}; }

  // A condition that mentions neither the variable nor inner names holds everywhere or nowhere.
  std::optional<Solution> if_fixed(const Expr& condition, bool is_true) {
    if (uses_variable(condition, variable_) || engine_.varies(condition)) return std::nullopt;
    return Solution{{}, is_true ? condition : logical_not(condition)};
  }

  static std::optional<Solution> all_of(const std::optional<Solution>& a,
                                        const std::optional<Solution>& b) {
    if (!a || !b) return std::nullopt;
    Solution both{intersection(a->interval, b->interval), a->needed};
    if (!both.needed.defined()) {
      both.needed = b->needed;
    } else if (b->needed.defined()) {
      both.needed = binary(Kind::And, both.needed, b->needed);
    }
    return both;
  }

  // Either solution is correct; one without a further condition is preferred, then the one with fewer ends.
  static std::optional<Solution> one_of(const std::optional<Solution>& a,
                                        const std::optional<Solution>& b) {
    if (!a || !b) return a ? a : b;
    const auto limits = [](const Solution& s) {
      const int ends = int{s.interval.min.defined()} + int{s.interval.max.defined()};
      return std::pair(s.needed.defined(), ends);
    };
    return limits(*b) < limits(*a) ? b : a;
  }

  std::optional<Solution> solve_comparison(Kind kind, const Expr& a, const Expr& b, bool is_true) {
    Sum d = plus(linear_form(a), linear_form(b), -1);
    Sum less = d, greater = times(d, -1);  // a < b and a > b as "<= 0"
    less.add_constant(1);
    greater.add_constant(1);
    auto nonpositive = [&](const Sum& form) { return solve_nonpositive(form); };
    switch (kind) {
      case Kind::LT:
        return is_true ? nonpositive(less) : nonpositive(times(d, -1));
      case Kind::LE:
        return is_true ? nonpositive(d) : nonpositive(greater);
      case Kind::GT:
        return is_true ? nonpositive(greater) : nonpositive(d);
      case Kind::GE:
        return is_true ? nonpositive(times(d, -1)) : nonpositive(less);
      case Kind::EQ:
      case Kind::NE:
        if (is_true == (kind == Kind::EQ)) return all_of(nonpositive(d), nonpositive(times(d, -1)));
        return one_of(nonpositive(less), nonpositive(greater));
      default:
        return std::nullopt;
    }
  }

  std::optional<Solution> solve_nonpositive(const Sum& form) {
    Expr sum = to_expr(form);
    if (!sum.defined()) return std::nullopt;
    Expr largest = engine_.bounds(sum).max;
    if (!largest.defined()) return std::nullopt;
    return isolate(linear_form(largest), most_levels);
  }

  // Solves form <= 0, which is free of inner names.
  std::optional<Solution> isolate(const Sum& form, int depth) {
    if (depth == 0 || !form.valid) return std::nullopt;
    const Term* direct = nullptr;
    const Term* compound = nullptr;
    for (const Term& term : form.terms) {
      if (!uses_variable(term.atom, variable_)) continue;
      if (term.atom.as<Variable>()) {
        direct = &term;
      } else if (!compound || !is_extreme(compound->atom)) {
        compound = &term;
      }
    }
    if (compound) return isolate_compound(form, *compound, depth);
    return direct ? isolate_variable(form, *direct) : if_nonpositive(form);
  }

  static std::optional<Solution> if_nonpositive(const Sum& form) {
    if (form.is_constant()) return form.constant <= 0 ? anywhere() : std::nullopt;
    Expr e = to_expr(form);
    if (!e.defined()) return std::nullopt;
    return Solution{{}, binary(Kind::LE, e, make_zero(e.type()))};
  }

  // The largest m with c*m + rest <= 0 for c > 0; the smallest for c < 0.
  static Expr limit(const Sum& rest, int64_t c) {
    Sum numerator = c > 0 ? times(rest, -1) : rest;
    if (c < 0) numerator.add_constant(-c - 1);
    Expr e = to_expr(numerator);
    return e.defined() ? canonical_div(e, c > 0 ? c : -c) : e;
  }

  std::optional<Solution> isolate_variable(const Sum& form, const Term& term) {
    Expr m = limit(without(form, term), term.factor);
    if (!m.defined()) return std::nullopt;
    return term.factor > 0 ? Solution{{{}, m}, {}} : Solution{{m, {}}, {}};
  }

  std::optional<Solution> isolate_compound(const Sum& form, const Term& term, int depth) {
    const Binary* op = term.atom.as<Binary>();
    if (is_extreme(term.atom)) {
      const auto with_arm = [&](const Expr& arm) { return with_replaced(form, term, arm); };
      return isolate_arms(term.atom, term.factor > 0, with_arm, depth);
    }
    if (op && term.atom.kind() == Kind::Div) {
      if (auto solution = isolate_division(form, term, *op, depth)) return solution;
      if (auto solution = isolate_arms_inside(form, term, *op, depth)) return solution;
    }
    Scope<Interval> any_value;
    any_value.push(variable_, Interval::everything());
    Interval range = bounds_of(term.atom, any_value);
    const Expr& worst = term.factor > 0 ? range.max : range.min;
    if (!worst.defined()) return std::nullopt;
    return isolate(with_replaced(form, term, worst), depth - 1);
  }

  static bool is_extreme(const Expr& e) { return e.kind() == Kind::Min || e.kind() == Kind::Max; }

  // The form grows (`grows`) or falls with a min or max, of which either arm is put in its place.
  template <class Replace>
  std::optional<Solution> isolate_arms(const Expr& extreme, bool grows, Replace with_arm,
                                       int depth) {
    const auto* op = extreme.as<Binary>();
    auto a = isolate(with_arm(op->a), depth - 1), b = isolate(with_arm(op->b), depth - 1);
    const bool needs_both = (extreme.kind() == Kind::Max) == grows;
    return needs_both ? all_of(a, b) : one_of(a, b);
  }

  // A min or max in the numerator: quotients by positive numbers grow with it.
  std::optional<Solution> isolate_arms_inside(const Sum& form, const Term& term, const Binary& op,
                                              int depth) {
    const auto k = as_const_int(op.b);
    const Sum numerator = linear_form(op.a);
    const auto inner = std::ranges::find_if(numerator.terms, [&](const Term& t) {
      return is_extreme(t.atom) && uses_variable(t.atom, variable_);
    });
    if (!k || *k <= 0 || inner == numerator.terms.end()) return std::nullopt;
    const auto with_arm = [&](const Expr& arm) {
      const Expr changed = to_expr(with_replaced(numerator, *inner, arm));
      Sum result = changed.defined() ? with_replaced(form, term, canonical_div(changed, *k)) : form;
      result.valid = result.valid && changed.defined();
      return result;
    };
    return isolate_arms(inner->atom, (inner->factor > 0) == (term.factor > 0), with_arm, depth);
  }

  std::optional<Solution> isolate_division(const Sum& form, const Term& term, const Binary& op,
                                           int depth) {
    auto k = as_const_int(op.b);
    Sum rest = without(form, term);
    auto mentions = [&](const Term& t) { return uses_variable(t.atom, variable_); };
    if (!k || *k <= 0 || std::ranges::any_of(rest.terms, mentions)) return std::nullopt;
    Expr m = limit(rest, term.factor);
    if (!m.defined()) return std::nullopt;
    Sum p = linear_form(op.a);
    if (term.factor > 0) {
      Sum above = plus(p, linear_form(m), -*k);
      above.add_constant(1 - *k);
      return isolate(above, depth - 1);
    }
    return isolate(plus(times(p, -1), linear_form(m), *k), depth - 1);
  }

  const std::string& variable_;
  BoundsEngine engine_;
};

}  // namespace

std::optional<Solution> solve_for(const Expr& condition, const std::string& variable,
                                  const Scope<Interval>& inner) {
  return Solver(variable, inner).solve(condition, true);
}

std::optional<LinearDecomposition> decompose(const Expr& e,
                                             const std::vector<std::string>& variables) {
  if (!has_linear_form(e.type())) return std::nullopt;
  Sum form = linear_form(e);
  LinearDecomposition result;
  std::unordered_set<std::string> names(variables.begin(), variables.end());
  Sum rest = linear_sum(form.type, form.constant);
  for (const Term& term : form.terms) {
    const Variable* v = term.atom.as<Variable>();
    if (v && names.count(v->name)) continue;
    if (uses_any_variable(term.atom, names)) return std::nullopt;
    rest.add(term.atom, term.factor);
  }
  for (const std::string& name : variables)
    result.coefficients.emplace_back(name, form.factor_of(name));
  result.rest = to_expr(rest);
  if (!result.rest.defined()) return std::nullopt;
  return result;
}

}  // namespace retrograde::analysis

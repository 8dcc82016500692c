#include "autodiff/stable_forms.h"

#include <algorithm>
#include <cmath>

#include "ir/build.h"
#include "ir/equal.h"

namespace retrograde::ir {

namespace {

Expr op1(Op op, const Expr& a) { return call_op(op, a.type(), {a}); }
Partial strong(Expr e) { return {std::move(e), Strength::Strong}; }

// exp(w) where e is 1 + exp(w).
Expr exp_of_one_plus_exp(const Expr& e) {
  const auto* sum = e.as<Add>();
  if (!sum || !(is_one(sum->a) || is_one(sum->b))) return {};
  Expr other = is_one(sum->a) ? sum->b : sum->a;
  const auto* call = other.as<Call>();
  return call && call->is_op(Op::exp) ? other : Expr();
}

// e / (1 + e), for e up to infinity.
Expr odds_to_probability(const Expr& e) {
  Expr one = make_one(e.type()), reciprocal = one / (one + e);
  return make_select(e > one, one - reciprocal, e * reciprocal);
}

// v = s / (1 + e), e = exp(w), q = e / (1 + e):  d/ds = 1 / (1 + e), d/dw = -v q
StableForm logistic(const Expr& v, const Div& quotient) {
  Expr e = exp_of_one_plus_exp(quotient.b);
  if (!e.defined()) return {};
  Expr reciprocal = make_one(v.type()) / quotient.b, w = e.as<Call>()->args[0];
  return {{quotient.a, w}, {strong(reciprocal), strong(-(v * odds_to_probability(e)))}};
}

// The terms of a sum; empty when there are more than four: longer ones are reductions.
std::vector<Expr> terms_of(const Expr& sum) {
  std::vector<Expr> terms, todo{sum};
  while (!todo.empty()) {
    Expr e = todo.back();
    todo.pop_back();
    if (const auto* add = e.as<Add>()) {
      todo.insert(todo.end(), {add->b, add->a});
    } else {
      terms.push_back(e);
    }
    if (terms.size() + todo.size() > 4) return {};
  }
  return terms;
}

const Call* as_operator(const Expr& e, Op op) {
  const auto* call = e.as<Call>();
  return call && call->is_op(op) ? call : nullptr;
}

// t / S for a term t that may be infinite, and S with it.
Expr ratio(const Expr& t, const Expr& sum) {
  Expr infinite = call_op(Op::is_inf, Bool(t.type().lanes()), {t});
  return make_select(infinite, make_one(t.type()), t / sum);
}

// v = log(S), S = sum of e_i and a constant, e_i = exp(w_i):  d/dw_i = e_i / S
StableForm log_sum_exp(const Expr& sum) {
  StableForm result;
  for (const Expr& term : terms_of(sum)) {
    if (is_const(term)) continue;
    const Call* e = as_operator(term, Op::exp);
    if (!e) return {};
    result.operands.push_back(e->args[0]);
    result.partials.push_back(strong(ratio(term, sum)));
  }
  return result;
}

// v = log(a / b):  d/da = 1 / a, d/db = -1 / b
StableForm log_of_quotient(const Expr& e) {
  const auto* quotient = e.as<Div>();
  if (!quotient || is_const(quotient->b) || !stable_form(e).operands.empty()) return {};
  const Expr one = make_one(e.type());
  return {{quotient->a, quotient->b},
          {{one, Strength::Strong, quotient->a}, {-one, Strength::Strong, quotient->b}}};
}

// v = a / S, S = a + R or |a| + R:          d/da = (R / S) / S, d/dt = -v / S for a term t of R
// and where a or t is an exponential, by its argument:  d/dw = v (R / S), d/dw = -v (t / S)
StableForm share(const Expr& v, const Div& quotient) {
  const Expr &a = quotient.a, &sum = quotient.b;
  std::vector<Expr> terms = terms_of(sum);
  auto own = std::find_if(terms.begin(), terms.end(), [&](const Expr& t) {
    const Call* magnitude = as_operator(t, Op::abs);
    return equal(t, a) || (magnitude && equal(magnitude->args[0], a));
  });
  if (is_const(a) || terms.size() < 2 || own == terms.end()) return {};
  terms.erase(own);
  StableForm result;
  auto add = [&](const Expr& e, const Expr& by_argument, const Expr& by_value) {
    const Call* exponential = as_operator(e, Op::exp);
    result.operands.push_back(exponential ? exponential->args[0] : e);
    result.partials.push_back(strong(exponential ? by_argument : by_value));
  };
  Expr rest;
  for (const Expr& t : terms) {
    rest = rest.defined() ? rest + t : t;
    if (!is_const(t)) add(t, -(v * ratio(t, sum)), -(v / sum));
  }
  add(a, v * ratio(rest, sum), ratio(rest, sum) / sum);
  return result;
}

// a where e is a * a or pow(a, 2).
Expr square_root_of(const Expr& e) {
  if (const auto* product = e.as<Mul>()) return equal(product->a, product->b) ? product->a : Expr();
  const Call* power = as_operator(e, Op::pow);
  return power && as_const_float(power->args[1]) == 2.0 ? power->args[0] : Expr();
}

// The components of the norm whose square the sum is; of a constant, its root. Empty: it is none.
std::vector<Expr> components_of(const Expr& sum) {
  std::vector<Expr> result;
  for (const Expr& term : terms_of(sum)) {
    auto constant = as_const_float(term);
    Expr a = !constant        ? square_root_of(term)
             : *constant >= 0 ? make_const(term.type(), std::sqrt(*constant))
                              : Expr();
    if (!a.defined()) return {};
    result.push_back(a);
  }
  return result;
}

// v = |a|:  d/da_i = a_i / |a|. With a constant among the squares these do not underflow.
StableForm norm(const Expr& sum) {
  StableForm result{components_of(sum), {}};
  if (result.operands.empty()) return {};
  if (std::any_of(result.operands.begin(), result.operands.end(),
                  [](const Expr& a) { return is_const(a); }))
    return {};
  for (const Expr& component : unit_vector(result.operands))
    result.partials.push_back(strong(component));
  return result;
}

std::vector<Expr> components_of_norm(const Expr& e) {
  if (const Call* hypot = as_operator(e, Op::hypot)) return hypot->args;
  const Call* root = as_operator(e, Op::sqrt);
  return root ? components_of(root->args[0]) : std::vector<Expr>{};
}

// v = a_i / |a| with u = a / |a|:  d/da_i = (sum of the other u_j^2) / |a|, d/da_j = -u_i u_j / |a|
// The same above the constant c for v = a_i / max(|a|, c), and 1 / c, 0 below.
StableForm normalised(const Div& quotient) {
  const auto* bounded = quotient.b.as<Max>();
  if (bounded && !is_const(bounded->b)) return {};
  const Expr& norm = bounded ? bounded->a : quotient.b;
  std::vector<Expr> a = components_of_norm(norm);
  size_t own = 0;
  while (own < a.size() && !equal(a[own], quotient.a)) ++own;
  if (a.size() < 2 || own == a.size()) return {};
  std::vector<Expr> u = unit_vector(a);
  StableForm result;
  auto add = [&](size_t j, const Expr& above, const Expr& below) {
    result.operands.push_back(a[j]);
    result.partials.push_back(
        strong(bounded ? make_select(norm > bounded->b, above, below) : above));
  };
  Expr others;
  for (size_t j = 0; j < a.size(); ++j) {
    if (j == own) continue;
    Expr scaled = u[j] / norm;
    others = others.defined() ? others + scaled * u[j] : scaled * u[j];
    if (!is_const(a[j])) add(j, -(scaled * u[own]), make_zero(norm.type()));
  }
  add(own, others, make_one(norm.type()) / quotient.b);
  return result;
}

StableForm of_quotient(const Expr& e, const Div& quotient) {
  for (const StableForm& form : {share(e, quotient), logistic(e, quotient), normalised(quotient)}) {
    if (!form.operands.empty()) return form;
  }
  return {};
}

}  // namespace

StableForm stable_form(const Expr& e) {
  if (!e.type().is_float()) return {};
  if (const auto* quotient = e.as<Div>()) return of_quotient(e, *quotient);
  if (const Call* log = as_operator(e, Op::log)) {
    const StableForm quotient = log_of_quotient(log->args[0]);
    return quotient.operands.empty() ? log_sum_exp(log->args[0]) : quotient;
  }
  if (const Call* sqrt = as_operator(e, Op::sqrt)) return norm(sqrt->args[0]);
  return {};
}

// Divided by |a_1| + ... + |a_n| first. Its own derivative cancels, so none is taken.
std::vector<Expr> unit_vector(const std::vector<Expr>& a) {
  Expr scale, squares;
  for (const Expr& e : a) scale = scale.defined() ? scale + op1(Op::abs, e) : op1(Op::abs, e);
  scale = op1(Op::stop_gradient, scale);
  std::vector<Expr> result;
  for (const Expr& e : a) {
    result.push_back(e / scale);
    Expr square = result.back() * result.back();
    squares = squares.defined() ? squares + square : square;
  }
  Expr zero = make_zero(scale.type()), at_origin = scale == zero;
  Expr inverse = make_one(scale.type()) / op1(Op::sqrt, squares);
  for (Expr& e : result) e = make_select(at_origin, zero, e * inverse);
  return result;
}

}  // namespace retrograde::ir

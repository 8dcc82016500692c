#include "autodiff/stable_forms.h"

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

// With e = exp(w), q = e / (1 + e):   v = s / (1 + e):  d/ds = 1 / (1 + e), d/dw = -v q
//                                     v = e / (1 + e):  d/dw = v / (1 + e)
StableForm logistic(const Expr& v, const Div& quotient) {
  Expr e = exp_of_one_plus_exp(quotient.b);
  if (!e.defined()) return {};
  Expr reciprocal = make_one(v.type()) / quotient.b, w = e.as<Call>()->args[0];
  if (equal(quotient.a, e)) return {{w}, {strong(v * reciprocal)}};
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

// v = log(S), S = sum of e_i and a constant, e_i = exp(w_i):  d/dw_i = e_i / S
StableForm log_sum_exp(const Expr& sum) {
  StableForm result;
  for (const Expr& term : terms_of(sum)) {
    if (is_const(term)) continue;
    const auto* call = term.as<Call>();
    if (!call || !call->is_op(Op::exp)) return {};
    result.operands.push_back(call->args[0]);
    result.partials.push_back(strong(term / sum));
  }
  return result;
}

// a where e is a * a or pow(a, 2).
Expr square_root_of(const Expr& e) {
  if (const auto* product = e.as<Mul>()) return equal(product->a, product->b) ? product->a : Expr();
  const auto* call = e.as<Call>();
  if (!call || !call->is_op(Op::pow)) return {};
  return as_const_float(call->args[1]) == 2.0 ? call->args[0] : Expr();
}

std::vector<Expr> squared_terms(const Expr& sum) {
  std::vector<Expr> result;
  for (const Expr& term : terms_of(sum)) {
    Expr a = square_root_of(term);
    if (!a.defined() || is_const(a)) return {};
    result.push_back(a);
  }
  return result;
}

StableForm norm(const Expr& sum) {
  StableForm result{squared_terms(sum), {}};
  if (result.operands.empty()) return {};
  for (const Expr& component : unit_vector(result.operands))
    result.partials.push_back(strong(component));
  return result;
}

}  // namespace

StableForm stable_form(const Expr& e) {
  if (!e.type().is_float()) return {};
  if (const auto* quotient = e.as<Div>()) return logistic(e, *quotient);
  const auto* call = e.as<Call>();
  if (call && call->is_op(Op::log)) return log_sum_exp(call->args[0]);
  if (call && call->is_op(Op::sqrt)) return norm(call->args[0]);
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

#include "autodiff/rules/stable_forms.h"

#include <algorithm>
#include <optional>

#include "autodiff/rules/stable_norms.h"
#include "autodiff/rules/stable_patterns.h"
#include "autodiff/rules/stable_quotients.h"
#include "ir/build.h"
#include "ir/equal.h"

namespace retrograde::autodiff {

namespace {

// Returns exp(w) if e is 1 + exp(w), else an undefined Expr.
Expr exp_of_one_plus_exp(const Expr& e) {
  const auto* sum = e.as<Add>();
  if (!sum || !(is_one(sum->a) || is_one(sum->b))) return {};
  Expr other = is_one(sum->a) ? sum->b : sum->a;
  return as_op(other, Op::exp) ? other : Expr();
}

// e / (1 + e), finite also for an infinite e.
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

Expr is_infinite(const Expr& e) { return call_op(Op::is_inf, Bool(e.type().lanes()), {e}); }

// t / S for a term t of the sum S. A t that is infinite makes S infinite, and the ratio 1.
Expr ratio(const Expr& t, const Expr& sum) {
  return make_select(is_infinite(t), make_one(t.type()), t / sum);
}

// 1 / (the number of infinite terms), where terms[own] is infinite.
Expr share_of_infinite(const std::vector<Expr>& terms, size_t own) {
  const Expr one = make_one(terms[own].type()), half = make_const(one.type(), 0.5);
  if (terms.size() == 2) return make_select(is_infinite(terms[1 - own]), half, one);
  Expr count = one;
  for (size_t i = 0; i < terms.size(); ++i) {
    if (i != own) count = count + make_select(is_infinite(terms[i]), one, make_zero(one.type()));
  }
  return terms.size() == 1 ? one : one / count;
}

// v = log(S), S = sum of e_i and a constant, e_i = exp(w_i):  d/dw_i = e_i / S
StableForm log_sum_exp(const Expr& sum) {
  StableForm result;
  std::vector<Expr> terms;
  for (const Expr& term : terms_of(sum)) {
    if (is_const(term)) continue;
    const Call* e = as_op(term, Op::exp);
    if (!e) return {};
    terms.push_back(term);
    result.operands.push_back(e->args[0]);
  }
  for (size_t i = 0; i < terms.size(); ++i) {
    const Expr share = share_of_infinite(terms, i);
    result.partials.push_back(strong(make_select(is_infinite(terms[i]), share, terms[i] / sum)));
  }
  return result;
}

// v = log(a / b):  d/da = 1 / a, d/db = -1 / b
StableForm log_of_quotient(const Expr& e) {
  const auto* quotient = e.as<Div>();
  if (!quotient || is_const(quotient->b) || stable_form(e).is_found()) return {};
  const Expr one = make_one(e.type());
  return {{quotient->a, quotient->b},
          {{one, Strength::Strong, quotient->a}, {-one, Strength::Strong, quotient->b}}};
}

// v = a / S, S = a + R or |a| + R:          d/da = (R / S) / S, d/dt = -v / S for a term t of R
// and where a or t is an exponential, by its argument:  d/dw = v (R / S), d/dw = -v (t / S)
StableForm share(const Expr& v, const Div& quotient) {
  const Expr &a = quotient.a, &sum = quotient.b;
  std::vector<Expr> terms = terms_of(sum);
  auto own = std::ranges::find_if(terms, [&](const Expr& t) {
    const Call* magnitude = as_op(t, Op::abs);
    return equal(t, a) || (magnitude && equal(magnitude->args[0], a));
  });
  if (is_const(a) || terms.size() < 2 || own == terms.end()) return {};
  terms.erase(own);
  StableForm result;
  auto add = [&](const Expr& e, const Expr& by_argument, const Expr& by_value) {
    const Call* exponential = as_op(e, Op::exp);
    result.add(exponential ? exponential->args[0] : e,
               strong(exponential ? by_argument : by_value));
  };
  Expr rest;
  for (const Expr& t : terms) {
    add_term(rest, t);
    if (!is_const(t)) add(t, -(v * ratio(t, sum)), -(v / sum));
  }
  add(a, v * ratio(rest, sum), ratio(rest, sum) / sum);
  return result;
}

struct Coefficients {
  Expr term;  // 1 for constants
  double above = 0, below = 0;
};

// Writes numerator and denominator as linear combinations of the same terms. Empty if they are no such sums or have too
// many terms.
std::vector<Coefficients> coefficients_of(const Div& quotient) {
  std::vector<Coefficients> result;
  auto add = [&](const SignedTerm& t, double Coefficients::*side) {
    const auto constant = as_const_float(t.value);
    const Expr term = constant ? make_one(t.value.type()) : t.value;
    auto known =
        std::ranges::find_if(result, [&](const Coefficients& c) { return equal(c.term, term); });
    if (known == result.end()) known = result.insert(result.end(), {term, 0, 0});
    (*known).*side += t.sign * constant.value_or(1);
  };
  for (const SignedTerm& t : signed_terms_of(quotient.a)) add(t, &Coefficients::above);
  for (const SignedTerm& t : signed_terms_of(quotient.b)) add(t, &Coefficients::below);
  const bool is_common = std::ranges::any_of(result, [](const Coefficients& c) {
    return !is_const(c.term) && c.above != 0 && c.below != 0;
  });
  return is_common ? result : std::vector<Coefficients>{};
}

// v = N / S, N = sum of n_t t, S = sum of s_t t:  dv/dt = sum of (n_t s_u - s_t n_u) u / S / S
// In n_t / S - v s_t / S the terms with u = t would cancel. If t is an exponential, the derivative by its argument is t
// times that.
StableForm ratio_of_sums(const Div& quotient) {
  StableForm result;
  const std::vector<Coefficients> terms = coefficients_of(quotient);
  for (const Coefficients& t : terms) {
    if (is_const(t.term)) continue;
    Expr sum;
    for (const Coefficients& u : terms) {
      const double c = t.above * u.below - t.below * u.above;
      if (c == 0) continue;
      add_term(sum, make_const(t.term.type(), c) * ratio(u.term, quotient.b));
    }
    if (!sum.defined()) continue;
    const Call* e = as_op(t.term, Op::exp);
    result.add(e ? e->args[0] : t.term,
               strong(e ? sum * ratio(t.term, quotient.b) : sum / quotient.b));
  }
  return result;
}

StableForm of_quotient(const Expr& e, const Div& quotient) {
  for (const StableForm& form : {share(e, quotient), ratio_of_sums(quotient), logistic(e, quotient),
                                 normalised_form(e), quotient_form(e, quotient)}) {
    if (form.is_found()) return form;
  }
  return {};
}

// v = atan(a / b) gets the partials of atan2, because the square of the quotient overflows. At b = 0 the value jumps
// and the partials are 0.
StableForm angle(const Expr& e) {
  const auto* quotient = e.as<Div>();
  if (!quotient || is_const(quotient->b)) return {};
  std::vector<Expr> gradient = angle_gradient(quotient->a, quotient->b);
  const Expr zero = make_zero(e.type());
  for (Expr& partial : gradient) partial = make_select(quotient->b == zero, zero, partial);
  return {{quotient->a, quotient->b}, {strong(gradient[0]), strong(gradient[1])}};
}

// Returns the constant c if a is c b.
std::optional<double> multiple_of(const Expr& a, const Expr& b) {
  if (const double sign = sign_between(a, b); sign != 0) return sign;
  const auto* product = a.as<Mul>();
  if (!product) return std::nullopt;
  if (equal(product->a, b)) return as_const_float(product->b);
  return equal(product->b, b) ? as_const_float(product->a) : std::nullopt;
}

// v = c b log(b):      dv/db = c (log(b) + 1): in log(b) + b / b the quotient 1 / b overflows
// v = c p log(p / q):  dv/dp = c (log(p / q) + 1), dv/dq = -c p / q
StableForm entropy(const Expr& factor, const Expr& logarithm) {
  const Call* log = as_op(logarithm, Op::log);
  if (!log) return {};
  const auto* quotient = log->args[0].as<Div>();
  std::optional<double> c = multiple_of(factor, log->args[0]);
  const bool is_relative = !c && quotient;
  const Expr& p = is_relative ? quotient->a : log->args[0];
  if (is_relative) c = multiple_of(factor, p);
  if (!c || is_const(p)) return {};
  const Expr scale = make_const(p.type(), *c);
  StableForm result{{p}, {strong(scale * (logarithm + make_one(p.type())))}};
  if (is_relative && !is_const(quotient->b)) {
    result.add(quotient->b, strong(-(scale * log->args[0])));
  }
  return result;
}
StableForm of_product(const Mul& product) {
  const StableForm form = entropy(product.a, product.b);
  return !form.is_found() ? entropy(product.b, product.a) : form;
}

// ---- max(a, b) + log(1 + exp(-|a - b|)) ----

// Returns exp(-|d|) if e is log(1 + exp(-|d|)), else an undefined Expr.
Expr decay_of(const Expr& e) {
  const Call* log = as_op(e, Op::log);
  return log ? exp_of_one_plus_exp(log->args[0]) : Expr();
}
// Whether e is exp(-|a - b|), or exp(-|a|) where b is 0.
bool is_decay_by(const Expr& e, const Expr& a, const Expr& b) {
  const Expr exponent = e.as<Call>()->args[0], size = without_sign(exponent);
  const Call* distance = as_op(size, Op::abs);
  if (!distance || size.same_as(exponent)) return false;
  const Expr& d = distance->args[0];
  const auto* difference = d.as<Sub>();
  const auto is_by = [&](const Expr& x, const Expr& y) {
    return is_zero(y) ? equal(without_sign(d), without_sign(x))
                      : difference && equal(difference->a, x) && equal(difference->b, y);
  };
  return is_by(a, b) || is_by(b, a);
}

// v = max(a, b) + log(1 + exp(-|a - b|)) + rest = log(exp(a) + exp(b)) + rest is smooth where its parts have a kink:
//   dv/da = 1 / (1 + exp(b - a)), dv/db = 1 / (1 + exp(a - b))
// With -min(a, b) in place of the maximum, the operands are -a and -b.
StableForm smooth_maximum(const Expr& sum) {
  std::vector<SignedTerm> terms = signed_terms_of(sum);
  const auto logarithm = std::ranges::find_if(
      terms, [](const SignedTerm& t) { return t.sign > 0 && decay_of(t.value).defined(); });
  if (logarithm == terms.end()) return {};
  const Expr decay = decay_of(logarithm->value);
  terms.erase(logarithm);
  const auto extreme = std::ranges::find_if(terms, [&](const SignedTerm& t) {
    const auto* pair = t.value.as<Binary>();
    return pair && pair->kind == (t.sign > 0 ? Kind::Max : Kind::Min) &&
           is_decay_by(decay, pair->a, pair->b);
  });
  if (extreme == terms.end()) return {};
  const SignedTerm pair = *extreme;
  terms.erase(extreme);
  StableForm result;
  auto add = [&](const Expr& operand, const Partial& partial) {
    if (!is_const(operand)) result.add(operand, partial);
  };
  const Expr one = make_one(sum.type()), sign = make_const(sum.type(), pair.sign);
  auto add_logistic = [&](const Expr& x, const Expr& y) {
    const Expr behind = pair.sign > 0 ? y - x : x - y;
    add(x, strong(sign / (one + call_op(Op::exp, sum.type(), {behind}))));
  };
  const auto* ends = pair.value.as<Binary>();
  add_logistic(ends->a, ends->b);
  add_logistic(ends->b, ends->a);
  for (const SignedTerm& t : terms) add(t.value, {make_const(sum.type(), t.sign)});
  return result;
}

// v = a - a + rest: dv/da = 0. Along the two paths an infinite adjoint would reach a as inf - inf.
StableForm sum_that_cancels(const Expr& sum) {
  std::vector<SignedTerm> distinct;
  bool cancels = false;
  for (const SignedTerm& t : signed_terms_of(sum)) {
    if (is_const(t.value)) continue;
    auto known = std::ranges::find_if(distinct,
                                      [&](const SignedTerm& d) { return equal(d.value, t.value); });
    if (known == distinct.end()) known = distinct.insert(distinct.end(), {t.value, 0});
    known->sign += t.sign;
    cancels |= known->sign == 0;
  }
  StableForm result;
  if (!cancels) return result;
  for (const SignedTerm& t : distinct) {
    result.add(t.value, {t.sign == 0 ? Expr() : make_const(sum.type(), t.sign)});
  }
  return result;
}

}  // namespace

StableForm stable_form(const Expr& e) {
  if (!e.type().is_float()) return {};
  if (const auto* quotient = e.as<Div>()) return of_quotient(e, *quotient);
  if (e.as<Add>() || e.as<Sub>()) {
    const StableForm form = smooth_maximum(e);
    return !form.is_found() ? sum_that_cancels(e) : form;
  }
  if (const Call* log = as_op(e, Op::log)) {
    const StableForm quotient = log_of_quotient(log->args[0]);
    return !quotient.is_found() ? log_sum_exp(log->args[0]) : quotient;
  }
  if (const auto* product = e.as<Mul>()) {
    const StableForm form = of_product(*product);
    if (form.is_found()) return form;
  }
  if (const Call* arctangent = as_op(e, Op::atan)) return angle(arctangent->args[0]);
  for (const StableForm& form : {norm_form(e), squared_norm_form(e)}) {
    if (form.is_found()) return form;
  }
  return normalised_form(e);
}

}  // namespace retrograde::autodiff

// The derivative tables: one row for each operator.
//
// Sources: [GW] Griewank & Walther, Evaluating Derivatives, 2nd ed., tables 2.1 and 14.1; [DLMF] NIST Digital Library
// of Mathematical Functions. "definition" means that the rule follows from the operator's definition in this project.
#include "autodiff/rules/derivative_rules.h"

#include <limits>
#include <map>
#include <numbers>

#include "autodiff/rules/power_partials.h"
#include "autodiff/rules/stable_norms.h"
#include "ir/build.h"

namespace retrograde::autodiff {

namespace {

using Args = const std::vector<Expr>&;
using Partials = std::vector<Partial>;

Expr num(const Expr& like, double value) { return make_const(like.type(), value); }
Expr square(const Expr& a) { return a * a; }
double largest_of(Type type) {
  return type.bits() == 64   ? std::numeric_limits<double>::max()
         : type.bits() == 32 ? std::numeric_limits<float>::max()
         : type.is_bfloat()  ? 0x1.fep127
                             : 65504;
}
Partial plain(Expr e) { return {std::move(e), Strength::Plain}; }
Partial quotient(Expr e, Expr divisor) {
  return {std::move(e), Strength::Strong, std::move(divisor)};
}

// The derivative of |u|: sign(u), which is 0 at 0.
Expr sign(const Expr& u) {
  return make_select(u > num(u, 0), num(u, 1), make_select(u < num(u, 0), num(u, -1), num(u, 0)));
}

Partials abs_partials(Args a, const Expr&) { return {plain(sign(a[0]))}; }
Partials absd_partials(Args a, const Expr&) {
  Expr s = sign(a[0] - a[1]);
  return {plain(s), plain(-s)};
}
Partials lerp_partials(Args a, const Expr&) {
  return {plain(num(a[2], 1) - a[2]), plain(a[2]), plain(a[1] - a[0])};
}
Partials fma_partials(Args a, const Expr&) {
  return {plain(a[1]), plain(a[0]), plain(make_one(a[2].type()))};
}
Partials sqrt_partials(Args a, const Expr& v) { return {quotient(num(a[0], 0.5), v)}; }
Partials exp_partials(Args, const Expr& v) { return {strong(v)}; }
Partials log_partials(Args a, const Expr&) { return {quotient(num(a[0], 1), a[0])}; }
Partials pow_partials(Args a, const Expr& v) { return power_partials(a, v, Op::pow, Op::log); }
Partials fast_pow_partials(Args a, const Expr& v) {
  return power_partials(a, v, Op::fast_pow, Op::fast_log);
}
Partials hypot_partials(Args a, const Expr&) {
  std::vector<Expr> unit = unit_vector(a);
  return {strong(unit[0]), strong(unit[1])};
}
Partials sin_partials(Args a, const Expr&) { return {strong(call_op(Op::cos, {a[0]}))}; }
Partials cos_partials(Args a, const Expr&) { return {strong(-call_op(Op::sin, {a[0]}))}; }
Partials tan_partials(Args a, const Expr& v) { return {strong(num(a[0], 1) + square(v))}; }
// 1 - x^2 loses digits near the poles; (1 - x)(1 + x) keeps them.
Expr one_minus_square(const Expr& x) { return (num(x, 1) - x) * (num(x, 1) + x); }
Partials asin_partials(Args a, const Expr&) {
  return {strong(num(a[0], 1) / call_op(Op::sqrt, {one_minus_square(a[0])}))};
}
Partials acos_partials(Args a, const Expr&) {
  return {strong(num(a[0], -1) / call_op(Op::sqrt, {one_minus_square(a[0])}))};
}
Partials atan_partials(Args a, const Expr&) {
  return {strong(num(a[0], 1) / (num(a[0], 1) + square(a[0])))};
}
Partials atan2_partials(Args a, const Expr&) {
  const std::vector<Expr> gradient = angle_gradient(a[0], a[1]);
  return {strong(gradient[0]), strong(gradient[1])};
}
Partials sinh_partials(Args a, const Expr&) { return {strong(call_op(Op::cosh, {a[0]}))}; }
Partials cosh_partials(Args a, const Expr&) { return {strong(call_op(Op::sinh, {a[0]}))}; }
// 1 - v^2 has no digits left where v has rounded to 1. 4 e / (1 + e)^2 with e = exp(-2 |x|) keeps them.
Partials tanh_partials(Args a, const Expr&) {
  Expr e = call_op(Op::exp, {num(a[0], -2) * call_op(Op::abs, {a[0]})});
  return {strong(num(a[0], 4) * e / square(num(a[0], 1) + e))};
}
Partials asinh_partials(Args a, const Expr&) {
  return {strong(num(a[0], 1) / call_op(Op::hypot, a[0].type(), {a[0], num(a[0], 1)}))};
}
Partials acosh_partials(Args a, const Expr&) {
  const Expr& x = a[0];
  return {strong(num(x, 1) /
                 (call_op(Op::sqrt, {x - num(x, 1)}) * call_op(Op::sqrt, {x + num(x, 1)})))};
}
Partials atanh_partials(Args a, const Expr&) {
  return {strong(num(a[0], 1) / one_minus_square(a[0]))};
}
// Computes exp(-x^2) as exp(-h^2) exp(-(x - h)(x + h)), where h is x rounded to sixteenths, so that h^2 is exact. In
// exp(-x^2) the rounding error of a large x^2 would become a factor of the result. Beyond 30 both factors are 0.
Partials erf_partials(Args a, const Expr&) {
  const Expr& x = a[0];
  Expr h = call_op(Op::floor, {x * num(x, 16)}) / num(x, 16);
  Expr rest = make_select(call_op(Op::abs, {x}) < num(x, 30), (x - h) * (x + h), num(x, 0));
  return {strong(num(x, 2 * std::numbers::inv_sqrtpi) * call_op(Op::exp, {-square(h)}) *
                 call_op(Op::exp, {-rest}))};
}
Partials fast_log_partials(Args a, const Expr&) { return {quotient(num(a[0], 1), a[0])}; }
Partials fast_sin_partials(Args a, const Expr&) { return {strong(call_op(Op::fast_cos, {a[0]}))}; }
Partials fast_cos_partials(Args a, const Expr&) { return {strong(-call_op(Op::fast_sin, {a[0]}))}; }
Partials fast_inverse_partials(Args, const Expr& v) { return {strong(-square(v))}; }
Partials fast_inverse_sqrt_partials(Args, const Expr& v) {
  return {strong(num(v, -0.5) * v * square(v))};
}
Partials saturating_cast_partials(Args a, const Expr& v) {
  Expr inside = cast_to(a[0].type(), v) == a[0];
  if (v.type().can_represent(a[0].type())) return {plain(make_one(v.type()))};
  if (v.type().is_float()) inside = call_op(Op::abs, {a[0]}) <= num(a[0], largest_of(v.type()));
  return {plain(make_select(inside, make_one(v.type()), make_zero(v.type())))};
}
// Where x is 0, the value is 0 for every y. The partial by y is then a strong zero, even against an infinite or NaN
// adjoint or tangent. The partial by x is y there, too, as in the product rule.
Partials strong_mul_partials(Args a, const Expr&) { return {strong(a[1]), {a[0], Strength::Both}}; }
Partials strong_div_partials(Args a, const Expr& v) {
  return {quotient(num(a[0], 1), a[1]), {-v, Strength::Strong, a[1], true}};
}

Partials add_partials(Args a, const Expr&) {
  return {plain(make_one(a[0].type())), plain(make_one(a[0].type()))};
}
Partials sub_partials(Args a, const Expr&) {
  return {plain(make_one(a[0].type())), plain(num(a[0], -1))};
}
Partials mul_partials(Args a, const Expr&) { return {plain(a[1]), plain(a[0])}; }
Partials div_partials(Args a, const Expr& v) {
  if (is_const(a[1]) && !is_zero(a[1])) return {plain(num(a[0], 1) / a[1]), Partial{}};
  return {quotient(num(a[0], 1), a[1]), quotient(-v, a[1])};
}
Partials mod_partials(Args a, const Expr&) {
  return {plain(make_one(a[0].type())), strong(-call_op(Op::floor, {a[0] / a[1]}))};
}
DerivativeRule smooth(PartialsFn partials, const char* domain, const char* convention,
                      const char* formula, const char* infinities, int max_ulp,
                      const char* source = "[GW] table 2.1") {
  return {RuleClass::Smooth, partials,   -1,     domain, convention, source,
          formula,           infinities, max_ulp};
}
DerivativeRule constant_rule(const char* convention) {
  return {RuleClass::Constant,           nullptr,    -1,
          "everywhere but at the steps", convention, "definition"};
}
DerivativeRule transparent(int arg,
                           const char* convention = "1: the value is the argument unchanged") {
  return {RuleClass::Transparent, nullptr, arg, "everywhere", convention, "definition"};
}
DerivativeRule no_rule(const char* reason) {
  return {RuleClass::NoRule, nullptr, -1, "", reason, "definition"};
}

using OpTable = std::map<Op, DerivativeRule>;
constexpr const char* approximated = "as for the exact function";

OpTable algebraic_operators() {
  return {
      {Op::abs, smooth(abs_partials, "x != 0", "0 at 0", "sign(x)", "-1 at -inf, 1 at +inf", 0)},
      {Op::absd, smooth(absd_partials, "x != y", "0 where x = y", "sign(x - y), -sign(x - y)",
                        "-1 or 1; 0 for equal infinities", 0)},
      {Op::lerp, smooth(lerp_partials, "everywhere", "no kinks; integer weights are constants",
                        "1 - w, w, y - x", "infinite or NaN, like the value", 1, "definition")},
      {Op::fma,
       smooth(fma_partials, "everywhere", "as for x * y + w", "y, x, 1", "as for x * y + w", 0)},
      {Op::sqrt,
       smooth(sqrt_partials, "x > 0", "+inf at +0, -inf at -0, with strong zeros; NaN for x < 0",
              "1 / (2 v)", "0 at +inf", 2)},
      {Op::hypot,
       smooth(hypot_partials, "(x, y) != (0, 0)", "0 at the origin, the smallest subgradient",
              "x / v, y / v, scaled by max(|x|, |y|)", "NaN", 2)},
      {Op::saturating_cast, smooth(saturating_cast_partials, "inside the type's range",
                                   "0 where the value saturates; casts to integers: 0", "1 or 0",
                                   "0, because the value saturates", 0, "definition")},
      {Op::strong_div, smooth(strong_div_partials, "y != 0", "as for Div, always with strong zeros",
                              "1 / y, -v / y", "as for Div, with strong zeros", 2, "definition")},
      {Op::strong_mul,
       smooth(strong_mul_partials, "everywhere", "as for Mul, always with strong zeros", "y, x",
              "as for Mul, with strong zeros", 0, "definition")},
  };
}

OpTable transcendental_operators() {
  return {
      {Op::exp, smooth(exp_partials, "everywhere", "no kinks; inf where exp overflows", "v",
                       "0 at -inf, inf at +inf", 1)},
      {Op::log, smooth(log_partials, "x > 0",
                       "+inf at +0, -inf at -0; 1 / x for x < 0, where the value is NaN", "1 / x",
                       "0 at +inf", 1)},
      {Op::pow,
       smooth(pow_partials, "x > 0, or integer y",
              "dx = 0 where y = 0; dy = 0 where x = 0; dy is NaN for x < 0",
              "y x^(y-1), or y v / x, v log x",
              "as for x^(y-1) and v log x; a pole may have either sign if y - 1 is inexact", 3)},
      {Op::sin, smooth(sin_partials, "everywhere", "no kinks", "cos x", "NaN, like the value", 1)},
      {Op::cos, smooth(cos_partials, "everywhere", "no kinks", "-sin x", "NaN, like the value", 1)},
      {Op::tan, smooth(tan_partials, "x != pi/2 + k pi", "large near the poles", "1 + v^2",
                       "NaN, like the value", 4)},
      {Op::asin, smooth(asin_partials, "|x| < 1", "inf at -1 and 1; NaN for |x| > 1",
                        "1 / sqrt((1 - x)(1 + x))", "NaN, like the value", 3)},
      {Op::acos, smooth(acos_partials, "|x| < 1", "-inf at -1 and 1; NaN for |x| > 1",
                        "-1 / sqrt((1 - x)(1 + x))", "NaN, like the value", 3)},
      {Op::atan, smooth(atan_partials, "everywhere", "no kinks", "1 / (1 + x^2)", "0", 3)},
      {Op::atan2, smooth(atan2_partials, "(x, y) != (0, 0)", "0 at the origin",
                         "y / r / r, -x / r / r with r = hypot(x, y), scaled",
                         "0 if an operand is infinite", 4, "[DLMF] 4.24")},
      {Op::sinh, smooth(sinh_partials, "everywhere", "no kinks; inf where cosh overflows", "cosh x",
                        "inf", 2)},
      {Op::cosh, smooth(cosh_partials, "everywhere", "no kinks; inf where sinh overflows", "sinh x",
                        "-inf at -inf, inf at +inf", 2)},
      {Op::tanh, smooth(tanh_partials, "everywhere", "no kinks",
                        "4 e / (1 + e)^2 with e = exp(-2 |x|)", "0", 6)},
      {Op::asinh,
       smooth(asinh_partials, "everywhere", "no kinks", "1 / hypot(x, 1)", "0", 2, "[DLMF] 4.40")},
      {Op::acosh, smooth(acosh_partials, "x > 1", "inf at 1; NaN for x < 1",
                         "1 / (sqrt(x - 1) sqrt(x + 1))", "0 at +inf", 4, "[DLMF] 4.40")},
      {Op::atanh, smooth(atanh_partials, "|x| < 1",
                         "inf at -1 and 1; the formula for |x| > 1, where the value is NaN",
                         "1 / ((1 - x)(1 + x))", "0, although the value is NaN", 3, "[DLMF] 4.40")},
      {Op::erf, smooth(erf_partials, "everywhere", "no kinks", "2 / sqrt(pi) exp(-x^2)", "0", 4,
                       "[DLMF] 7.2")},
  };
}

OpTable approximate_operators() {
  return {
      {Op::fast_exp, smooth(exp_partials, "everywhere", approximated, "v", "as for exp", -1)},
      {Op::fast_log, smooth(fast_log_partials, "x > 0", approximated, "1 / x", "as for log", 1)},
      {Op::fast_pow, smooth(fast_pow_partials, "as for pow", approximated,
                            "as for pow, with fast_pow and fast_log", "as for pow", -1)},
      {Op::fast_sin,
       smooth(fast_sin_partials, "everywhere", approximated, "fast_cos x", "NaN", -1)},
      {Op::fast_cos,
       smooth(fast_cos_partials, "everywhere", approximated, "-fast_sin x", "NaN", -1)},
      {Op::fast_inverse, smooth(fast_inverse_partials, "x != 0", approximated, "-v^2", "0", -1)},
      {Op::fast_inverse_sqrt,
       smooth(fast_inverse_sqrt_partials, "x > 0", approximated, "-v^3 / 2", "0 at +inf", -1)},
  };
}

// Operators whose derivative is 0, and operators that return an argument under a promise.
OpTable other_operators() {
  const char* bits = "defined on integers only";
  const char* test = "its value is true or false";
  const char* steps = "constant between steps; 0 at the steps by convention";
  const char* promise = "1 for the first argument; the bounds are only promises";
  return {
      {Op::bitwise_and, constant_rule(bits)},
      {Op::bitwise_or, constant_rule(bits)},
      {Op::bitwise_xor, constant_rule(bits)},
      {Op::bitwise_not, constant_rule(bits)},
      {Op::shift_left, constant_rule(bits)},
      {Op::shift_right, constant_rule(bits)},
      {Op::popcount, constant_rule(bits)},
      {Op::count_leading_zeros, constant_rule(bits)},
      {Op::count_trailing_zeros, constant_rule(bits)},
      {Op::is_nan, constant_rule(test)},
      {Op::is_inf, constant_rule(test)},
      {Op::is_finite, constant_rule(test)},
      {Op::floor, constant_rule(steps)},
      {Op::ceil, constant_rule(steps)},
      {Op::round, constant_rule(steps)},
      {Op::trunc, constant_rule(steps)},
      {Op::undef, constant_rule("may be any value")},
      {Op::random, constant_rule("depends only on its seeds")},
      {Op::promise_clamped, transparent(0, promise)},
      {Op::unsafe_promise_clamped, transparent(0, promise)},
      {Op::stop_gradient,
       {RuleClass::Blocked, nullptr, -1, "everywhere", "the program requests it", "definition"}},
  };
}

OpTable make_op_table() {
  OpTable t = other_operators();
  t.merge(algebraic_operators());
  t.merge(transcendental_operators());
  t.merge(approximate_operators());
  for (int i = 0; i < op_count; ++i) {
    const Op op = static_cast<Op>(i);
    if (op_info(op).cls == OpClass::Internal) {
      t.emplace(op, no_rule("made by lowering only, after differentiation"));
    } else if (passed_operand(op) >= 0) {
      t.emplace(op, transparent(passed_operand(op)));
    }
  }
  return t;
}

// min and max: the operand that the primal returns gets the whole adjoint. At a tie exactly one of them gets it, so the
// partials sum to 1.
Partials taken_partials(Args a, const Expr& first_taken) {
  Type type = a[0].type();
  return {plain(make_select(first_taken, make_one(type), make_zero(type))),
          plain(make_select(first_taken, make_zero(type), make_one(type)))};
}
Partials min_partials(Args a, const Expr&) { return taken_partials(a, a[0] < a[1]); }
Partials max_partials(Args a, const Expr&) { return taken_partials(a, a[0] > a[1]); }

using KindTable = std::map<Kind, DerivativeRule>;
KindTable make_kind_table() {
  KindTable t = {
      {Kind::Add, smooth(add_partials, "everywhere", "no kinks", "1, 1", "1, 1", 0)},
      {Kind::Sub, smooth(sub_partials, "everywhere", "no kinks", "1, -1", "1, -1", 0)},
      {Kind::Mul, smooth(mul_partials, "everywhere",
                         "no kinks; strong zeros where a factor may be infinite or NaN", "y, x",
                         "infinite, except for strong zeros", 0)},
      {Kind::Div,
       smooth(div_partials, "y != 0", "infinite at y = 0, with strong zeros; integers: 0",
              "1 / y, -v / y", "0 for infinite y", 2)},
      {Kind::Mod, smooth(mod_partials, "x / y is not an integer",
                         "the same partials at the steps; integers: 0", "1, -floor(x / y)",
                         "NaN, like the value", 0, "definition")},
      {Kind::Min, smooth(min_partials, "x != y", "1 for the selected operand; at a tie that is y",
                         "1, 0 or 0, 1", "as for finite operands", 0, "definition")},
      {Kind::Max, smooth(max_partials, "x != y", "1 for the selected operand; at a tie that is y",
                         "1, 0 or 0, 1", "as for finite operands", 0, "definition")},
      {Kind::Select,
       {RuleClass::Smooth, nullptr, -1, "where the condition does not change",
        "1 for the chosen arm, exactly 0 for the other", "definition", "1 or 0",
        "as for finite operands", 0}},
      {Kind::Cast,
       transparent(
           0,
           "between floats, the adjoint is converted; to or from integers, the derivative is 0")},
      {Kind::Reinterpret, no_rule("the bits of a value are no differentiable function of it")},
  };
  for (Kind k : {Kind::EQ, Kind::NE, Kind::LT, Kind::LE, Kind::GT, Kind::GE, Kind::And, Kind::Or,
                 Kind::Not}) {
    t.emplace(k, constant_rule("its value is true or false"));
  }
  return t;
}

const OpTable& op_table() {
  static const OpTable table = make_op_table();
  return table;
}
const KindTable& kind_table() {
  static const KindTable table = make_kind_table();
  return table;
}

}  // namespace

const DerivativeRule& derivative_rule(Op op) {
  auto it = op_table().find(op);
  RETROGRADE_ASSERT(it != op_table().end(), "no row for operator ", op_info(op).name);
  return it->second;
}

const DerivativeRule& derivative_rule(Kind kind) {
  auto it = kind_table().find(kind);
  RETROGRADE_ASSERT(it != kind_table().end(), "no row for ", kind_name(kind));
  return it->second;
}

bool has_derivative_rule(Kind kind) { return kind_table().contains(kind); }

bool has_poles(const Call& call) {
  const PartialPoles poles = op_info(call.op).real.poles;
  if (poles != PartialPoles::PolesBelowOne) return poles == PartialPoles::Poles;
  const auto exponent = as_const_float(call.args.back());
  return !exponent || *exponent < 1;
}

bool levels_off(Op op) { return op_info(op).real.levels == Levels::LevelsOff; }

}  // namespace retrograde::autodiff

// Tests the table of derivative rules: it covers all operators, agrees with central differences in double, and follows
// its stated conventions at kinks and poles.
#include "autodiff/rules/derivative_rules.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "autodiff/rules/value_range.h"
#include "autodiff/sweeps/reverse_sweep.h"
#include "diagnostics/error.h"
#include "frontend/language/func.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/print.h"
#include "ir/scalar.h"
#include "support/errors.h"
#include "support/evaluate.h"

namespace retrograde::autodiff {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
const double nan = std::nan("");
using Env = std::map<std::string, double>;

Scalar eval(const Expr& e, const Env& env) {
  std::map<std::string, Scalar> values;
  for (const auto& [name, value] : env) values[name] = Scalar::of_float(e.type(), value);
  return test::Evaluator(values)(e).at(0);
}

const ValueRanges nothing_known;

// Leaves are variables that count as reads of images; the gradient by every one is requested.
Env gradient(const Expr& e, const Env& env, double seed = 1) {
  SweepResult sweep = sweep_reverse(
      {e}, {make_const(adjoint_type(e.type()), seed)},
      [](const Expr& leaf) { return leaf.as<Variable>() != nullptr; }, nothing_known);
  Env result;
  for (const auto& [name, value] : env) result[name] = 0;
  for (const LeafAdjoint& leaf : sweep.leaves) {
    result[leaf.leaf.as<Variable>()->name] += eval(leaf.adjoint, env).as_double();
  }
  return result;
}

void expect_central_differences(const Expr& e, const Env& env) {
  Env found = gradient(e, env);
  for (const auto& [name, value] : env) {
    auto slope = [&](double h) {
      Env up = env, down = env;
      up[name] += h;
      down[name] -= h;
      return (eval(e, up).as_double() - eval(e, down).as_double()) / (2 * h);
    };
    double h = 1e-3 * (1 + std::abs(value));
    double expected = (4 * slope(h / 2) - slope(h)) / 3;
    EXPECT_NEAR(found[name], expected, 1e-6 * (1 + std::abs(expected)))
        << "d/d" << name << " of " << e;
  }
}

const Type f64 = Float(64);
const Expr x = variable("x", f64), y = variable("y", f64), w = variable("w", f64);
Expr op(Op o, const std::vector<Expr>& args) { return call_op(o, args[0].type(), args); }
Expr num(double v) { return make_const(f64, v); }

TEST(DerivativeRules, EveryOperatorHasARuleOrAReason) {
  for (int i = 0; i < op_count; ++i) {
    const Op o = static_cast<Op>(i);
    const DerivativeRule& rule = derivative_rule(o);
    EXPECT_STRNE(rule.convention, "") << op_info(o).name;
    EXPECT_STRNE(rule.source, "") << op_info(o).name;
    if (rule.cls == RuleClass::Smooth) {
      EXPECT_STRNE(rule.formula, "") << op_info(o).name;
      EXPECT_STRNE(rule.infinities, "") << op_info(o).name;
    }
    EXPECT_EQ(rule.cls == RuleClass::Smooth, rule.partials != nullptr) << op_info(o).name;
    EXPECT_TRUE(rule.cls != RuleClass::NoRule || op_info(o).cls == OpClass::Internal)
        << op_info(o).name;
  }
#define RETROGRADE_BINARY(K) EXPECT_TRUE(has_derivative_rule(Kind::K)) << #K;
#include "ir/kinds.def"
  for (Kind k : {Kind::Cast, Kind::Select, Kind::Not, Kind::Reinterpret})
    EXPECT_TRUE(has_derivative_rule(k));
}

TEST(DerivativeRules, AnOperatorWithoutARuleIsFound) {
  EXPECT_THROW(derivative_rule(Op::none), InternalError);
}

// Visits the partials and the value for every combination of these samples, with one operand or two.
void for_each_partial(Op o, const std::vector<double>& samples,
                      FunctionRef<void(const Env&, double value, double partial)> visit) {
  const size_t arity = static_cast<size_t>(op_info(o).arity);
  const Expr a = variable("x", Float(64)), b = variable("y", Float(64));
  const Expr e = arity == 1 ? call_op(o, {a}) : call_op(o, {a, b});
  for (double at_x : samples) {
    for (double at_y : arity == 1 ? std::vector<double>{1} : samples) {
      const Env env = arity == 1 ? Env{{"x", at_x}} : Env{{"x", at_x}, {"y", at_y}};
      for (const auto& [name, partial] : gradient(e, env))
        visit(env, eval(e, env).as_double(), partial);
    }
  }
}

// Strong products are excluded: their poles come from other operators.
bool is_function_of_numbers(Op o) {
  return derivative_rule(o).cls == RuleClass::Smooth && op_info(o).arity <= 2 &&
         o != Op::strong_mul && o != Op::strong_div;
}

TEST(DerivativeRules, PartialsArePolesWhereTheOperatorsRowSays) {
  for (int i = 0; i < op_count; ++i) {
    const Op o = static_cast<Op>(i);
    if (!is_function_of_numbers(o)) continue;
    bool found = false;
    for_each_partial(o, {-100, -2.5, -1, -0.5, 0, 0.5, 1, 2.5, 100},
                     [&](const Env&, double value, double partial) {
                       found |= std::isfinite(value) && std::isinf(partial);
                     });
    EXPECT_EQ(found, op_info(o).real.poles != PartialPoles::NoPoles) << op_info(o).name;
  }
}

TEST(DerivativeRules, ValuesLevelOffWhereTheOperatorsRowSays) {
  for (int i = 0; i < op_count; ++i) {
    const Op o = static_cast<Op>(i);
    if (!is_function_of_numbers(o) || o == Op::saturating_cast)
      continue;  // to a narrower type only
    bool found = false;
    for_each_partial(o, {-inf, -2.5, -0.5, 0, 0.5, 2.5, inf},
                     [&](const Env& env, double value, double partial) {
                       bool is_infinite = false;
                       for (const auto& [name, operand] : env) is_infinite |= std::isinf(operand);
                       found |= is_infinite && std::isfinite(value) && partial == 0;
                     });
    EXPECT_EQ(found, levels_off(o)) << op_info(o).name;
  }
}

// Points inside of each operator's domain; every smooth operator must be listed.
TEST(DerivativeRules, SmoothOperatorsAgreeWithCentralDifferences) {
  const std::map<Op, std::vector<Env>> points = {
      {Op::abs, {{{"x", 0.7}}, {{"x", -1.3}}}},
      {Op::absd, {{{"x", 0.7}, {"y", 1.5}}, {{"x", 2.0}, {"y", 0.5}}}},
      {Op::lerp, {{{"x", 0.7}, {"y", 1.5}, {"w", 0.3}}}},
      {Op::fma, {{{"x", 0.7}, {"y", 1.5}, {"w", -0.3}}}},
      {Op::sqrt, {{{"x", 0.4}}, {{"x", 9.0}}}},
      {Op::exp, {{{"x", -1.2}}, {{"x", 2.0}}}},
      {Op::log, {{{"x", 0.4}}, {{"x", 7.0}}}},
      {Op::pow, {{{"x", 1.7}, {"y", 2.3}}, {{"x", 0.6}, {"y", -1.2}}}},
      {Op::hypot, {{{"x", 3.0}, {"y", -4.0}}, {{"x", 0.1}, {"y", 0.0}}}},
      {Op::sin, {{{"x", 0.9}}}},
      {Op::cos, {{{"x", 0.9}}}},
      {Op::tan, {{{"x", 0.9}}}},
      {Op::asin, {{{"x", 0.6}}, {{"x", -0.9}}}},
      {Op::acos, {{{"x", 0.6}}, {{"x", -0.9}}}},
      {Op::atan, {{{"x", 1.6}}}},
      {Op::atan2, {{{"x", 1.6}, {"y", -0.7}}, {{"x", -0.2}, {"y", 0.0}}}},
      {Op::sinh, {{{"x", 1.1}}}},
      {Op::cosh, {{{"x", -1.1}}}},
      {Op::tanh, {{{"x", 0.8}}}},
      {Op::asinh, {{{"x", 2.2}}}},
      {Op::acosh, {{{"x", 1.9}}}},
      {Op::atanh, {{{"x", 0.55}}}},
      {Op::erf, {{{"x", 0.4}}}},
      {Op::fast_exp, {{{"x", 0.3}}}},
      {Op::fast_log, {{{"x", 1.4}}}},
      {Op::fast_pow, {{{"x", 1.4}, {"y", 1.5}}}},
      {Op::fast_sin, {{{"x", 0.8}}}},
      {Op::fast_cos, {{{"x", 0.8}}}},
      {Op::fast_inverse, {{{"x", 1.7}}}},
      {Op::fast_inverse_sqrt, {{{"x", 1.7}}}},
      {Op::saturating_cast, {{{"x", 1.7}}}},
      {Op::strong_div, {{{"x", 1.7}, {"y", 0.4}}}},
      {Op::strong_mul, {{{"x", 1.7}, {"y", 0.4}}}},
  };
  for (int i = 0; i < op_count; ++i) {
    const Op o = static_cast<Op>(i);
    if (derivative_rule(o).cls != RuleClass::Smooth) continue;
    auto listed = points.find(o);
    ASSERT_NE(listed, points.end()) << "no test point for " << op_info(o).name;
    std::vector<Expr> args{x, y, w};
    args.resize(static_cast<size_t>(op_info(o).arity));
    for (const Env& env : listed->second) expect_central_differences(op(o, args), env);
  }
}

TEST(DerivativeRules, ArithmeticAgreesWithCentralDifferences) {
  const Env env{{"x", 1.75}, {"y", -0.6}};
  for (const Expr& e :
       {x + y, x - y, x * y, x / y, x % num(0.5), min(x, y), max(x, y), select(x > y, x * x, y),
        x / num(3), clamp(x, num(0), num(1)), clamp(x, num(0), num(5))}) {
    expect_central_differences(e, env);
  }
  expect_central_differences(x % y, {{"x", 7.3}, {"y", 2.1}});
}

TEST(DerivativeRules, SharedNodesAreVisitedOnce) {
  Expr e = x;
  for (int i = 0; i < 64; ++i) e = e * num(0.5) + e * num(0.5);  // 2^64 paths
  EXPECT_DOUBLE_EQ(gradient(e, {{"x", 1}})["x"], 1);
}

// At a tie the primal takes the second operand, which gets all of the derivative (docs/derivatives.md).
TEST(DerivativeRules, TiesOfMinAndMaxGoToTheSecondOperand) {
  for (const double at : {0.5, 0.0, -3.0}) {
    for (const Expr& e : {min(x, y), max(x, y)}) {
      Env g = gradient(e, {{"x", at}, {"y", at}});
      EXPECT_EQ(g["x"], 0) << at;
      EXPECT_EQ(g["y"], 1) << at;
    }
  }
}

// A clamp is a max of a min, in which the bounds are the second operands.
TEST(DerivativeRules, ClampsAreFlatAtTheirBounds) {
  for (const double at : {0.0, 1.0})
    EXPECT_EQ(gradient(clamp(x, num(0), num(1)), {{"x", at}})["x"], 0) << at;
}

TEST(DerivativeRules, KinksGiveZeroWhereTheConventionSaysSo) {
  EXPECT_EQ(gradient(op(Op::abs, {x}), {{"x", 0}})["x"], 0);
  Env origin{{"x", 0}, {"y", 0}};
  for (Op o : {Op::hypot, Op::atan2}) {
    Env g = gradient(op(o, {x, y}), origin);
    EXPECT_EQ(g["x"], 0) << op_info(o).name;
    EXPECT_EQ(g["y"], 0) << op_info(o).name;
  }
  EXPECT_EQ(gradient(op(Op::pow, {x, y}), {{"x", 0}, {"y", 2}})["y"], 0);
  EXPECT_EQ(gradient(op(Op::pow, {x, y}), {{"x", 0}, {"y", 0}})["x"], 0);
  for (double at : {0.0, 5e-324, nan})
    EXPECT_EQ(gradient(op(Op::pow, {x, num(0)}), {{"x", at}})["x"], 0) << at;
  EXPECT_EQ(gradient(op(Op::floor, {x}), {{"x", 0.5}})["x"], 0);
}

TEST(DerivativeRules, PolesAreInfiniteForANonzeroAdjointOnly) {
  const std::map<Op, double> poles = {{Op::sqrt, 0}, {Op::log, 0},   {Op::asin, 1},
                                      {Op::acos, 1}, {Op::acosh, 1}, {Op::atanh, 1}};
  for (const auto& [o, at] : poles) {
    EXPECT_TRUE(std::isinf(gradient(op(o, {x}), {{"x", at}})["x"])) << op_info(o).name;
    // The branch not taken passes exactly zero, not inf * 0.
    Expr guarded = select(x > num(at), op(o, {x}), x * num(2));
    if (o == Op::asin || o == Op::acos || o == Op::atanh)
      guarded = select(x < num(at), op(o, {x}), x * num(2));
    EXPECT_EQ(gradient(guarded, {{"x", at}})["x"], 2) << op_info(o).name;
  }
}

TEST(DerivativeRules, UnselectedBranchesLeakNothingThroughProducts) {
  Expr risky = select(x > num(0), y * op(Op::sqrt, {num(1) / x}), y);
  Env g = gradient(risky, {{"x", 0}, {"y", 3}});
  EXPECT_EQ(g["x"], 0);
  EXPECT_EQ(g["y"], 1);
  Expr overflow = select(x > num(800), num(1), y / op(Op::exp, {x * num(1000)}));
  EXPECT_EQ(gradient(overflow, {{"x", 900}, {"y", 1}})["x"], 0);
}

TEST(DerivativeRules, TrueNaNsStayNaN) {
  EXPECT_TRUE(std::isnan(gradient(op(Op::sqrt, {x}) * y, {{"x", -1}, {"y", 1}})["x"]));
  EXPECT_TRUE(std::isnan(gradient(x * y, {{"x", 1}, {"y", nan}})["x"]));
  EXPECT_TRUE(std::isinf(gradient(x * y, {{"x", 1}, {"y", inf}})["x"]));
}

TEST(DerivativeRules, LargeArgumentsDoNotOverflowInThePartials) {
  Env huge{{"x", 3e200}, {"y", 4e200}};
  Env h = gradient(op(Op::hypot, {x, y}), huge);
  EXPECT_NEAR(h["x"], 0.6, 1e-12);
  Env a = gradient(op(Op::atan2, {y, x}), huge);
  EXPECT_NEAR(a["x"] * 1e201, -4.0 / 25 * 10, 1e-9);
  EXPECT_NEAR(gradient(op(Op::asinh, {x}), {{"x", 1e200}})["x"] * 1e200, 1, 1e-12);
}

// 1 / y overflows, but the derivative does not.
TEST(DerivativeRules, APowerWithoutAPoleIsDividedLast) {
  const Expr square = op(Op::pow, {x / y, num(2)});
  EXPECT_NEAR(gradient(square, {{"x", 0x1p-1070}, {"y", 0x1p-1045}})["x"] * 0x1p-1021, 1, 1e-15);
}

TEST(DerivativeRules, VectorsWhoseMagnitudesOverflowTogetherHaveDirections) {
  const double huge = 1.5e308;
  const Env at{{"x", huge}, {"y", huge}};
  EXPECT_NEAR(gradient(op(Op::hypot, {x, y}), at)["x"], std::sqrt(0.5), 1e-15);
  const Expr length = op(Op::sqrt, {x * x + y * y});
  for (const Expr& unit : {x / op(Op::hypot, {x, y}), x / length, x * (num(1) / length)})
    EXPECT_NEAR(gradient(unit, at)["x"] * huge, std::sqrt(0.125), 1e-10) << unit;
}

TEST(DerivativeRules, StopGradientAndIntegersPassNothing) {
  EXPECT_EQ(gradient(op(Op::stop_gradient, {x}) * y, {{"x", 2}, {"y", 3}})["x"], 0);
  EXPECT_EQ(gradient(cast_to(f64, cast_to(Int(32), x)) * y, {{"x", 2.5}, {"y", 3}})["x"], 0);
  EXPECT_EQ(gradient(op(Op::likely, {x}) * y, {{"x", 2}, {"y", 3}})["x"], 3);
}

TEST(DerivativeRules, CallsOfCFunctionsAreRefusedOnlyWhereTheGradientIsWanted) {
  Expr call = call_extern("mystery", f64, {x});
  EXPECT_THROW(gradient(call, {{"x", 1}}), Unsupported);
  SweepResult sweep = sweep_reverse(
      {call * y}, {num(1)},
      [](const Expr& leaf) { return leaf.as<Variable>() && leaf.as<Variable>()->name == "y"; },
      nothing_known);
  EXPECT_EQ(sweep.leaves.size(), 1u);
}

// Equal nodes arise from a user's helper function that is called twice, or from two values of a Tuple.
TEST(DerivativeRules, EqualNodesAreOne) {
  auto leaf = [] { return op(Op::exp, {variable("x", f64) * num(2)}); };
  SweepResult sweep = sweep_reverse(
      {leaf() * y, leaf() + y}, {num(3), num(5)},
      [](const Expr& e) { return e.as<Variable>() != nullptr; }, nothing_known);
  ASSERT_EQ(sweep.leaves.size(), 2u);
  const Env at{{"x", 0.5}, {"y", 7}};
  for (const LeafAdjoint& found : sweep.leaves) {
    const double expected =
        equal(found.leaf, y) ? 3 * std::exp(1.0) + 5 : 2 * std::exp(1.0) * (3 * 7 + 5);
    EXPECT_NEAR(eval(found.adjoint, at).as_double(), expected, 1e-12);
  }
}

TEST(DerivativeRules, ReadsOfTwoImagesOfOneNameAreTwo) {
  auto image = [] { return std::make_shared<ParameterContents>(); };
  auto a = image(), b = image();
  auto read = [](const auto& of) {
    return call_image("image", f64, {variable("i")}, SymbolRef(of));
  };
  SweepResult sweep = sweep_reverse(
      {read(a) * read(b)}, {num(1)}, [](const Expr& e) { return e.as<Call>() != nullptr; },
      nothing_known);
  EXPECT_EQ(sweep.leaves.size(), 2u);
}

// Leaves must not be rewritten, because an update looks for its own reads among them.
TEST(DerivativeRules, LeavesStayAsTheyAre) {
  const Expr read = call_image("image", f64, {variable("i") - variable("i")}, {});
  SweepResult sweep = sweep_reverse(
      {read * y}, {num(1)}, [](const Expr& e) { return e.as<Call>() != nullptr; }, nothing_known);
  ASSERT_EQ(sweep.leaves.size(), 1u);
  EXPECT_TRUE(equal(sweep.leaves[0].leaf, read)) << sweep.leaves[0].leaf;
}

TEST(DerivativeRules, NormsAtTheOriginHaveGradientZero) {
  for (const Expr& norm :
       {op(Op::sqrt, {x * x + y * y}), op(Op::hypot, {x, y}),
        op(Op::pow, {x * x + y * y, num(0.5)}), op(Op::sqrt, {x * x}), op(Op::abs, {x})}) {
    Env g = gradient(norm, {{"x", 0}, {"y", 0}});
    EXPECT_EQ(g["x"], 0) << norm;
    EXPECT_EQ(g["y"], 0) << norm;
  }
  EXPECT_EQ(gradient(op(Op::sqrt, {x}), {{"x", 0}})["x"], inf) << "no norm: the pole stays";
}

TEST(DerivativeRules, TheLogisticFunctionKeepsItsDigitsAtBothEnds) {
  const Expr logistic = num(1) / (num(1) + op(Op::exp, {-x}));
  for (double at : {-700.0, -300.0, -5.0, 0.0, 5.0, 30.0, 300.0, 700.0}) {
    double e = std::exp(-std::abs(at)), expected = e / ((1 + e) * (1 + e));
    EXPECT_NEAR(gradient(logistic, {{"x", at}})["x"] / expected, 1, 1e-14) << at;
  }
  EXPECT_EQ(gradient(logistic, {{"x", -1000}})["x"], 0) << "exp overflows";
  expect_central_differences(x / (op(Op::exp, {y * x}) + num(1)), {{"x", 1.2}, {"y", -0.7}});
}

// Points of the rule's domain that are exact in float32.
std::vector<Env> ulp_points(Op o) {
  std::vector<Env> points;
  uint32_t state = 12345;
  auto unit = [&] {
    state = state * 1664525u + 1013904223u;
    return (state >> 8) / static_cast<double>(1 << 24);
  };
  auto magnitude = [&](double low, double high) {
    return static_cast<double>(static_cast<float>(low * std::pow(high / low, unit())));
  };
  const bool in_unit = o == Op::asin || o == Op::acos || o == Op::atanh;
  const bool positive = o == Op::sqrt || o == Op::log || o == Op::pow || o == Op::acosh ||
                        o == Op::fast_log || o == Op::fast_inverse_sqrt;
  const double high = in_unit         ? 0.9999
                      : o == Op::erf  ? 8
                      : o == Op::tanh ? 40
                      : o == Op::pow  ? 8
                                      : 80;
  for (int i = 0; i < 2000; ++i) {
    double a = magnitude(o == Op::acosh ? 1.001 : 1e-4, high), b = magnitude(1e-3, high);
    if (!positive && unit() < 0.5) a = -a;
    if (unit() < 0.5) b = -b;
    points.push_back({{"x", a}, {"y", b}, {"w", static_cast<double>(static_cast<float>(unit()))}});
  }
  return points;
}

TEST(DerivativeRules, PartialsInFloat32AreWithinTheirStatedUlp) {
  const Type f32 = Float(32);
  for (int i = 0; i < op_count; ++i) {
    const Op o = static_cast<Op>(i);
    const DerivativeRule& rule = derivative_rule(o);
    if (rule.cls != RuleClass::Smooth || rule.max_ulp < 0) continue;
    std::vector<Expr> narrow, wide;
    for (int k = 0; k < op_info(o).arity; ++k) {
      const char* name = k == 0 ? "x" : k == 1 ? "y" : "w";
      narrow.push_back(variable(name, f32));
      wide.push_back(variable(name, f64));
    }
    double worst = 0;
    for (const Env& env : ulp_points(o)) {
      Env found = gradient(op(o, narrow), env), expected = gradient(op(o, wide), env);
      for (const auto& [name, value] : expected) {
        double size = std::abs(value);
        if (!(size > 1e-30 && size < 1e30)) continue;  // no normal float32
        double ulp = std::ldexp(1.0, std::ilogb(size) - 23);
        worst = std::max(worst, std::abs(found[name] - value) / ulp);
      }
    }
    EXPECT_LE(worst, rule.max_ulp + 0.5) << op_info(o).name;
    EXPECT_GE(worst, rule.max_ulp / 8.0) << op_info(o).name << ": stated too loosely";
  }
}

TEST(DerivativeRules, HalfPrecisionAccumulatesInFloat32) {
  EXPECT_EQ(adjoint_type(Float(16)), Float(32));
  EXPECT_EQ(adjoint_type(BFloat(16)), Float(32));
  EXPECT_EQ(adjoint_type(Float(64)), Float(64));
}

// This program is linked without a back end.
TEST(FrontEndAlone, SaysWhatToLink) {
  Func f("f");
  Var x("x");
  f(x) = x;
  expect_error<Unsupported>({"this program must be linked with the compiler"},
                            [&] { f.realize({4}); });
}

}  // namespace
}  // namespace retrograde::autodiff

// Tests deeply nested derivatives against closed forms, up to the sixth derivative: adjoints of adjoints, tangents of
// tangents and both mixed in every order. Mixed partials must not depend on the order in which they are taken. The
// programs include reductions, updates and custom adjoints.
#include "autodiff/custom_derivative.h"
#include "autodiff/jacobian.h"
#include "autodiff/second_order.h"
#include "frontend/data/param.h"
#include "gradient/gradient_check.h"

namespace retrograde::gradient {
namespace {

using Contributions = std::vector<AdjointContribution>;

class Nesting : public ::testing::Test {
 protected:
  Param<float> u{"u"}, v{"v"}, w{"w"};
  Func one{"one"};
  Nesting() {
    u.set(0.75f);
    v.set(-0.5f);
    w.set(1.25f);
    one() = 1.0f;
  }
  static Func reverse(const Func& f, const AdjointInput& by) {
    return propagate_adjoints(f, {.overwritten = Overwritten::Store, .wrt = {by}}).of(by);
  }
  Func forward(const Func& f, const AdjointInput& by) {
    return propagate_tangents(f, {{by, one}})(f);
  }
  // Takes one derivative for each letter of `modes`: r by an adjoint, f by a tangent.
  Func derivative(Func f, const AdjointInput& by, const std::string& modes) {
    for (char mode : modes) f = mode == 'r' ? reverse(f, by) : forward(f, by);
    return f;
  }
};

// The n-th derivative of exp(c u) sin(u) is the imaginary part of (c + i)^n exp((c + i) u).
double closed_form(double c, double u, int n) {
  double re = 1, im = 0;
  for (int k = 0; k < n; ++k) {
    double next = re * c - im;
    im = re + im * c;
    re = next;
  }
  return std::exp(c * u) * (re * std::sin(u) + im * std::cos(u));
}

TEST_F(Nesting, HigherDerivativesInEveryOrderOfModes) {
  Func f("f");
  f() = exp(u * 0.5f) * sin(u);
  for (const char* modes :
       {"r",   "f",   "rr",  "rf",   "fr",   "ff",   "rrr",   "rrf",   "rfr",    "frr",   "ffr",
        "frf", "rff", "fff", "rrrr", "ffff", "rfrf", "rrrrr", "fffff", "rrrrrr", "ffffff"}) {
    std::string order = modes;
    double expected = closed_form(0.5, 0.75, static_cast<int>(order.size()));
    EXPECT_NEAR(evaluate_scalar(derivative(f, u, order)), expected, 1e-11) << order;
  }
  Buffer<float> compiled = derivative(f, u, "rfr").realize();
  EXPECT_NEAR(compiled(), closed_form(0.5, 0.75, 3), 1e-5);
}

// A factor that is exactly 0 blocks an infinite adjoint, but the factor itself still has a derivative.
TEST_F(Nesting, FactorsThatAreZeroHaveDerivatives) {
  Expr a = u - 0.75f;
  for (const Expr& e : {pow(a * a + 1.0f, 0.5625f), sqrt(a * a + 0.25f), fast_pow(a * a + 1, w)}) {
    Func f("f");
    f() = e;
    double expected = evaluate_scalar(derivative(f, u, "ff"));
    EXPECT_GT(expected, 1);
    for (const char* modes : {"fr", "rf", "rr"})
      EXPECT_NEAR(evaluate_scalar(derivative(f, u, modes)), expected, 1e-12) << modes;
  }
}

TEST_F(Nesting, MixedPartialsInEveryOrder) {
  Func f("f");
  Expr x = u, y = v, z = w;
  f() = sin(x * y) * exp(y * z) + x * x * y * y * y * z;
  std::vector<AdjointInput> inputs = {u, v, w};
  std::vector<int> order = {0, 1, 2};
  std::vector<double> found;
  do {
    for (const char* modes : {"rrr", "fff", "rfr", "ffr"}) {
      Func d = f;
      for (size_t k = 0; k < 3; ++k)
        d = derivative(d, inputs[static_cast<size_t>(order[k])], std::string(1, modes[k]));
      found.push_back(evaluate_scalar(d));
    }
  } while (std::next_permutation(order.begin(), order.end()));
  // d3/dx dy dz of sin(x y) exp(y z) is d/dy of y^2 cos(x y) exp(y z).
  double a = 0.75, b = -0.5, c = 1.25, e = std::exp(b * c);
  double expected =
      e * (2 * b * std::cos(a * b) - a * b * b * std::sin(a * b) + c * b * b * std::cos(a * b)) +
      6 * a * b * b;
  ASSERT_EQ(found.size(), 24u);
  for (double value : found) EXPECT_NEAR(value, expected, 1e-11);
}

// Through a recurrence: s_n = u^n by n steps s <- s u, whose k-th derivative is n!/(n-k)! u^(n-k).
TEST_F(Nesting, ThroughARecurrence) {
  Var x("x");
  Func power("power"), f("f");
  RDom r(1, 6);
  power(x) = 1.0f;
  power(r) = power(r - 1) * u;
  f() = power(6);
  double u0 = 0.75;
  EXPECT_NEAR(evaluate_scalar(derivative(f, u, "r")), 6 * std::pow(u0, 5), 1e-12);
  EXPECT_NEAR(evaluate_scalar(derivative(f, u, "rf")), 30 * std::pow(u0, 4), 1e-12);
  EXPECT_NEAR(evaluate_scalar(derivative(f, u, "fr")), 30 * std::pow(u0, 4), 1e-12);
  EXPECT_NEAR(evaluate_scalar(derivative(f, u, "fff")), 120 * std::pow(u0, 3), 1e-12);
  EXPECT_NEAR(evaluate_scalar(derivative(f, u, "rff")), 120 * std::pow(u0, 3), 1e-12);
}

// cube(x) = u^3 by a rule whose slope is a Func with a rule, whose slope again is a Func with a rule.
Func with_rules(const Param<float>& u, int power, float factor) {
  Func f("monomial");
  Expr value = factor;
  for (int k = 0; k < power; ++k) value = value * u;
  f() = value + (power > 0 ? round(u) * 0.0f : Expr(0.0f));  // has no derivative that is right
  if (power == 0) return f;
  custom_adjoint(f, {u}, [u, power, factor](const AdjointContext& c) {
    Func adj("u_adj");
    adj() = c.adjoint()() * with_rules(u, power - 1, factor * static_cast<float>(power))();
    return Contributions{{u, adj}};
  });
  custom_tangent(f, {u}, [u, power, factor](const TangentContext& c) {
    Func tan("tan");
    tan() = c.tangent(u)() * with_rules(u, power - 1, factor * static_cast<float>(power))();
    return tan;
  });
  return f;
}

TEST_F(Nesting, ThroughCustomRulesOfCustomRules) {
  Func f = with_rules(u, 4, 1.0f);
  double u0 = 0.75;
  EXPECT_NEAR(evaluate_scalar(derivative(f, u, "r")), 4 * std::pow(u0, 3), 1e-12);
  for (const char* modes : {"rr", "rf", "fr", "ff"})
    EXPECT_NEAR(evaluate_scalar(derivative(f, u, modes)), 12 * u0 * u0, 1e-12) << modes;
  for (const char* modes : {"rrr", "fff", "rfr", "frf"})
    EXPECT_NEAR(evaluate_scalar(derivative(f, u, modes)), 24 * u0, 1e-12) << modes;
  EXPECT_NEAR(evaluate_scalar(derivative(f, u, "rfrf")), 24, 1e-12);
}

// The Jacobian of a Hessian's diagonal: third derivatives d3 / da_i^2 da_j, with nested seeds.
TEST_F(Nesting, JacobiansOfHessians) {
  Var x("x"), y("y");
  Buffer<float> a = random_image({5}, 0.25, 1.5, 1);
  Func loss("loss"), diagonal;
  RDom r(0, 4);
  loss() = 0.0f;
  loss() += a(r) * a(r) * a(r) * a(r + 1) + sin(a(r));
  diagonal = hessian_diagonal(loss, a).diagonal;
  Jacobian third = jacobian(diagonal, a, {{0, 5}});
  EXPECT_LE(third.colours(), 3);
  oracle::Array found = evaluate(third.dense(), {{0, 0}, {5, 5}});
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) {
      double expected = 0;
      if (i < 4 && j == i) expected = 6.0 * a(i + 1) - std::cos(1.0 * a(i));
      if (i < 4 && j == i + 1) expected = 6.0 * a(i);
      EXPECT_NEAR(found.at({i, j}).scalar.as_double(), expected, 1e-12) << i << " " << j;
    }
  }
}

}  // namespace
}  // namespace retrograde::gradient

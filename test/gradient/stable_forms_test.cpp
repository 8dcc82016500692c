// Tests functions as users write them, whose derivative would cancel, overflow or underflow if taken operator by
// operator. If value and true derivative are finite in float32, the gradient is right to a few ULP. The expected values
// are closed forms in long double.
#include <cmath>
#include <functional>
#include <limits>

#include "gradient/gradient_check.h"
#include "support/facts.h"

namespace retrograde::gradient {
namespace {

using Real = long double;

struct Shape {
  const char* name;
  std::function<Expr(Expr, Expr)> write;
  std::function<Real(Real, Real)> by_x;
  int max_ulp;
};

Real logistic_slope(Real x) {
  Real e = std::exp(-std::fabs(x));
  return e / ((1 + e) * (1 + e));
}
Real logistic(Real x) { return x > 0 ? 1 / (1 + std::exp(-x)) : std::exp(x) / (1 + std::exp(x)); }

// The derivative of (exp(x) - 1) / x, for the points used below.
Real growth_slope(Real x) {
  const Real series = 0.5L + x / 3 + x * x / 8 + x * x * x / 30;
  return std::fabs(x) < 0.002L ? series : (std::exp(x) - std::expm1(x) / x) / x;
}
// The derivative of log(1 + x) / x.
Real logarithm_slope(Real x) {
  const Real series = -0.5L + x * 2 / 3 - x * x * 3 / 4 + x * x * x * 4 / 5;
  return std::fabs(x) < 0.002L ? series : (1 / (1 + x) - std::log1p(x) / x) / x;
}

// An exponential is denormal or overflows: the derivative has only as many digits left as the value.
bool is_wide(Real x, Real y) { return std::min(x, y) < -87 || std::max(x, y) > 87; }

const std::vector<Shape>& shapes() {
  static const std::vector<Shape> all = {
      {"1 / (1 + exp(-x))", [](Expr x, Expr) { return 1.0f / (1.0f + exp(-x)); },
       [](Real x, Real) { return logistic_slope(x); }, 6},
      {"1 / (exp(-x) + 1)", [](Expr x, Expr) { return 1.0f / (exp(-x) + 1.0f); },
       [](Real x, Real) { return logistic_slope(x); }, 6},
      {"exp(x) / (1 + exp(x))", [](Expr x, Expr) { return exp(x) / (1.0f + exp(x)); },
       [](Real x, Real) { return logistic_slope(x); }, 6},
      {"1 - 1 / (1 + exp(x))", [](Expr x, Expr) { return 1.0f - 1.0f / (1.0f + exp(x)); },
       [](Real x, Real) { return logistic_slope(x); }, 6},
      {"(1 + tanh(x / 2)) / 2", [](Expr x, Expr) { return (1.0f + tanh(x / 2.0f)) / 2.0f; },
       [](Real x, Real) { return logistic_slope(x); }, 8},
      {"y / (1 + exp(-x)), swish", [](Expr x, Expr) { return x / (1.0f + exp(-x)); },
       [](Real x, Real) { return logistic(x) + x * logistic_slope(x); }, 16},
      {"log(1 / (1 + exp(-x)))", [](Expr x, Expr) { return log(1.0f / (1.0f + exp(-x))); },
       [](Real x, Real) { return logistic(-x); }, 8},
      {"-log(1 + exp(-x))", [](Expr x, Expr) { return -log(1.0f + exp(-x)); },
       [](Real x, Real) { return logistic(-x); }, 6},
      {"log(1 + exp(x))", [](Expr x, Expr) { return log(1.0f + exp(x)); },
       [](Real x, Real) { return logistic(x); }, 6},
      // If exp(x) is denormal, the derivative has only as many digits left as the value.
      {"log(exp(x) + exp(y))", [](Expr x, Expr y) { return log(exp(x) + exp(y)); },
       [](Real x, Real y) { return x < -87 ? std::nanl("") : logistic(x - y); }, 6},
      {"softmax", [](Expr x, Expr y) { return exp(x) / (exp(x) + exp(y)); },
       [](Real x, Real y) { return is_wide(x, y) ? std::nanl("") : logistic_slope(x - y); }, 8},
      {"softmax, by the other", [](Expr x, Expr y) { return exp(y) / (exp(x) + exp(y) + exp(y)); },
       [](Real x, Real y) {
         Real e = std::exp(x - y);
         return is_wide(x, y) ? std::nanl("") : -(1 / (e + 2)) * (e / (e + 2));
       },
       8},
      {"x / (x + y)", [](Expr x, Expr y) { return x / (x + y); },
       [](Real x, Real y) { return x * y < 0 ? std::nanl("") : y / (x + y) / (x + y); }, 6},
      {"x / (1 + |x|)", [](Expr x, Expr) { return x / (1.0f + abs(x)); },
       [](Real x, Real) { return 1 / (1 + std::fabs(x)) / (1 + std::fabs(x)); }, 4},
      {"x / sqrt(x*x + y*y)", [](Expr x, Expr y) { return x / sqrt(x * x + y * y); },
       [](Real x, Real y) {
         Real n = std::hypot(x, y);
         return n < 1e-18L || n > 1e19L ? std::nanl("") : y / n * (y / n) / n;
       },
       12},
      {"x / hypot(x, y)", [](Expr x, Expr y) { return x / hypot(x, y); },
       [](Real x, Real y) {
         Real n = std::hypot(x, y);
         return n < 1e-37L || n > 3e38L ? std::nanl("") : y / n * (y / n) / n;
       },
       12},
      {"x / max(sqrt(x*x + y*y), 1e-12)",
       [](Expr x, Expr y) { return x / max(sqrt(x * x + y * y), 1e-12f); },
       [](Real x, Real y) {
         Real n = std::hypot(x, y);
         return n > 1e19L ? std::nanl("") : n > 1e-12L ? y / n * (y / n) / n : 1 / Real(1e-12f);
       },
       12},
      {"log(1 + x)", [](Expr x, Expr) { return log(1.0f + x); },
       [](Real x, Real) { return x <= -1 ? std::nanl("") : 1 / (1 + x); }, 2},
      {"exp(x) - 1", [](Expr x, Expr) { return exp(x) - 1.0f; },
       [](Real x, Real) { return std::exp(x); }, 2},
      {"max(-x, 0) + log(1 + exp(-|x|))",
       [](Expr x, Expr) { return max(-x, 0.0f) + log(1.0f + exp(-abs(x))); },
       [](Real x, Real) { return -logistic(-x); }, 6},
      {"log(1 + exp(-|x|)) - min(x, 0)",
       [](Expr x, Expr) { return log(1.0f + exp(-abs(x))) - min(x, 0.0f); },
       [](Real x, Real) { return -logistic(-x); }, 6},
      {"max(x - y, 0) + log(1 + exp(-|x - y|))",
       [](Expr x, Expr y) { return max(x - y, 0.0f) + log(1.0f + exp(-abs(x - y))); },
       [](Real x, Real y) {
         const Real d = static_cast<float>(x) - static_cast<float>(y);
         return logistic(d);
       },
       6},
      {"(x - y) / (x + y)", [](Expr x, Expr y) { return (x - y) / (x + y); },
       [](Real x, Real y) {
         return x * y < 0 || std::fabs(x + y) > 3e38L ? std::nanl("") : 2 * y / (x + y) / (x + y);
       },
       6},
      {"(1 - x*x) / (1 + x*x)", [](Expr x, Expr) { return (1.0f - x * x) / (1.0f + x * x); },
       [](Real x, Real) {  // as a quotient by x*x it is denormal from 1e9 on
         return std::fabs(x) > 1e9L ? std::nanl("") : -4 * x / (1 + x * x) / (1 + x * x);
       },
       8},
      {"tanh by exponentials", [](Expr x, Expr) { return (exp(x) - exp(-x)) / (exp(x) + exp(-x)); },
       [](Real x, Real) { return 4 * logistic_slope(2 * x); }, 8},
      {"(exp(2 x) - 1) / (exp(2 x) + 1)",
       [](Expr x, Expr) { return (exp(2.0f * x) - 1.0f) / (exp(2.0f * x) + 1.0f); },
       [](Real x, Real) { return 4 * logistic_slope(2 * x); }, 8},
      {"sin(x) / x", [](Expr x, Expr) { return sin(x) / x; },
       [](Real x, Real) {
         const Real series = -x / 3 + x * x * x / 30;
         return std::fabs(x) < 0.001L ? series : (std::cos(x) - std::sin(x) / x) / x;
       },
       24},
      {"(exp(x) - 1) / x", [](Expr x, Expr) { return (exp(x) - 1.0f) / x; },
       [](Real x, Real) { return growth_slope(x); }, 24},
      {"(1 - exp(-x)) / x", [](Expr x, Expr) { return (1.0f - exp(-x)) / x; },
       [](Real x, Real) { return -growth_slope(-x); }, 24},
      {"-log(1 - x) / x", [](Expr x, Expr) { return -log(1.0f - x) / x; },
       [](Real x, Real) { return -logarithm_slope(-x); }, 24},
      {"x log(x)", [](Expr x, Expr) { return x * log(x); },
       [](Real x, Real) { return x > 0 ? std::log(x) + 1 : std::nanl(""); }, 4},
      {"-log(x) x", [](Expr x, Expr) { return log(x) * -x; },
       [](Real x, Real) { return x > 0 ? -1 - std::log(x) : std::nanl(""); }, 4},
      {"y log(y / x)", [](Expr x, Expr y) { return y * log(y / x); },
       [](Real x, Real y) { return -y / x; }, 2},
      {"atan(x / y)", [](Expr x, Expr y) { return atan(x / y); },
       [](Real x, Real y) {
         const Real r = std::hypot(x, y);
         return y == 0 ? std::nanl("") : y / r / r;
       },
       12},
      {"x * fast_inverse_sqrt(x*x + y*y)",
       [](Expr x, Expr y) { return x * fast_inverse_sqrt(x * x + y * y); },
       [](Real x, Real y) {
         Real n = std::hypot(x, y);
         return n < 1e-18L || n > 1e19L ? std::nanl("") : y / n * (y / n) / n;
       },
       12},
      {"pow(x*x + y*y, -0.5) * x", [](Expr x, Expr y) { return pow(x * x + y * y, -0.5f) * x; },
       [](Real x, Real y) {
         Real n = std::hypot(x, y);
         return n < 1e-18L || n > 1e19L ? std::nanl("") : y / n * (y / n) / n;
       },
       12},
      {"pow(x*x + y*y, -0.5)", [](Expr x, Expr y) { return pow(x * x + y * y, -0.5f); },
       [](Real x, Real y) {
         Real n = std::hypot(x, y);
         return n < 1e-18L || n > 1e19L ? std::nanl("") : -x / n / n / n;
       },
       12},
      {"sqrt(x*x)", [](Expr x, Expr) { return sqrt(x * x); },
       [](Real x, Real) { return x > 0   ? 1
                                 : x < 0 ? -1
                                         : 0; }, 4},
      {"sqrt(x*x + y*y)", [](Expr x, Expr y) { return sqrt(x * x + y * y); },
       [](Real x, Real y) { return x == 0 ? 0 : x / std::hypot(x, y); }, 4},
      {"sqrt(pow(x, 2) + pow(y, 2))", [](Expr x, Expr y) { return sqrt(pow(x, 2) + pow(y, 2)); },
       [](Real x, Real y) { return x == 0 ? 0 : x / std::hypot(x, y); }, 4},
      {"hypot(x, y)", [](Expr x, Expr y) { return hypot(x, y); },
       [](Real x, Real y) { return x == 0 ? 0 : x / std::hypot(x, y); }, 4},
      {"sqrt(x*x + y*y + 1)", [](Expr x, Expr y) { return sqrt(x * x + y * y + 1.0f); },
       [](Real x, Real y) { return x / std::sqrt(x * x + y * y + 1); }, 4},
  };
  return all;
}

std::vector<float> extremes() {
  std::vector<float> all;
  for (float v : {0.0f,  1e-45f, 1e-40f, 2e-38f, 1e-30f, 1e-22f, 1e-19f, 1e-10f, 1e-5f,
                  1e-3f, 0.3f,   1.0f,   3.0f,   10.0f,  17.0f,  25.0f,  50.0f,  80.0f,
                  87.0f, 88.5f,  100.0f, 1e3f,   1e10f,  1e18f,  1e25f,  3e38f}) {
    all.push_back(v);
    all.push_back(-v);
  }
  return all;
}

// Errors below the smallest normal number are not counted.
double ulps(float found, Real expected) {
  if (!std::isfinite(found)) return 1e30;
  if (std::fabs(static_cast<Real>(found) - expected) < std::numeric_limits<float>::min()) return 0;
  float size = std::max(std::fabs(static_cast<float>(expected)), std::numeric_limits<float>::min());
  return static_cast<double>(std::fabs(static_cast<Real>(found) - expected) /
                             (std::nextafter(size, 2 * size) - size));
}

TEST(StableForms, AreFiniteWhereExpIsDenormal) {
  Buffer<float> x(2), one(1);
  x(0) = -100, x(1) = -101, one(0) = 1;
  Var i("i");
  Func f("f");
  f(i) = log(exp(x(i)) + exp(x(i + 1)));
  Buffer<float> gradient = propagate_adjoints(f, one)(x).realize({2});
  EXPECT_NEAR(gradient(0), logistic(1), 0.02);
  EXPECT_NEAR(gradient(1), logistic(-1), 0.02);
}

TEST(StableForms, ShareWhatAnInfiniteSumHasAmongItsInfiniteTerms) {
  Buffer<float> x(2), one(1);
  x(0) = 100, x(1) = 100, one(0) = 1;
  Var i("i");
  Func f("f");
  f(i) = log(exp(x(i)) + exp(x(i + 1)));
  Func gradient = propagate_adjoints(f, one)(x);
  Buffer<float> equal = gradient.realize({2});
  EXPECT_EQ(equal(0), 0.5f);
  EXPECT_EQ(equal(1), 0.5f);
  x(1) = 3;
  Buffer<float> found = gradient.realize({2});
  EXPECT_EQ(found(0), 1);
  EXPECT_EQ(found(1), 0);
}

TEST(StableForms, AreRightToAFewUlpWhereverTheyAreFinite) {
  const std::vector<float> values = extremes();
  const int n = static_cast<int>(values.size());
  Buffer<float> x(n, n), y(n, n), ones(n, n);
  ones.fill(1);
  x.for_each_element([&](int i, int j) {
    x(i, j) = values[static_cast<size_t>(i)], y(i, j) = values[static_cast<size_t>(j)];
  });
  for (const Shape& shape : shapes()) {
    Var i("i"), j("j");
    Func f("f");
    f(i, j) = shape.write(x(i, j), y(i, j));
    Buffer<float> value = f.realize({n, n});
    Buffer<float> gradient = propagate_adjoints(f, ones)(x).realize({n, n});
    int checked = 0;
    for (int b = 0; b < n; ++b) {
      for (int a = 0; a < n; ++a) {
        const Real expected = shape.by_x(x(a, b), y(a, b));
        if (!std::isfinite(value(a, b)) || !std::isfinite(static_cast<float>(expected))) continue;
        ++checked;
        EXPECT_LE(ulps(gradient(a, b), expected), shape.max_ulp)
            << shape.name << " at " << x(a, b) << ", " << y(a, b) << ": " << gradient(a, b)
            << " instead of " << expected;
      }
    }
    EXPECT_GT(checked, n * n / 3) << shape.name;
  }
}

// The parts have kinks at 0, but the sum and its derivative do not.
TEST(StableForms, HaveDerivativesOfTheirOwn) {
  Buffer<float> x(3), one(3);
  x(0) = 0, x(1) = -2, x(2) = 1.5f;
  one.fill(1);
  Var i("i");
  Func f("f"), sine("sine");
  f(i) = max(x(i), 0.0f) + log(1.0f + exp(-abs(x(i))));
  sine(i) = sin(x(i)) / x(i);
  const auto second = [&](const Func& g) {
    return propagate_adjoints(propagate_adjoints(g, one)(x), one)(x).realize({3});
  };
  Buffer<float> of_softplus = second(f), of_sine = second(sine);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(of_softplus(k), logistic_slope(x(k)), 1e-6);
  EXPECT_NEAR(of_sine(0), -1.0 / 3, 1e-6);
}

// Softmax over Funcs, shifted by the largest value as usual. The adjoint that passes through the maximum is exactly 0.
// If it were summed, only rounding errors would remain, and the largest element would receive them.
class OverFuncs : public ::testing::Test {
 protected:
  static constexpr int n = 300;
  Var i{"i"};
  RDom r{0, n};
  Buffer<float> x = Buffer<float>(n);
  Func largest{"largest"}, weight{"weight"}, total{"total"}, loss{"loss"};

  OverFuncs() {
    largest() = x(Expr(0));
    largest() = max(largest(), x(r));
    weight(i) = exp(x(i) - largest());
    total() = 0.0f;
    total() += weight(r);
  }
  // The gradient of softmax; `spread`: the range of the values.
  std::vector<Real> probabilities(float offset, float spread) {
    std::vector<Real> p(n);
    Real top = -1e9L, sum = 0;
    for (int k = 0; k < n; ++k) x(k) = offset + spread * static_cast<float>((k * 37) % 101) / 101;
    for (int k = 0; k < n; ++k) top = std::max(top, static_cast<Real>(x(k)));
    for (int k = 0; k < n; ++k)
      sum += p[static_cast<size_t>(k)] = std::exp(static_cast<Real>(x(k)) - top);
    for (Real& v : p) v /= sum;
    return p;
  }
  // `magnitude`: the magnitude of the terms that each element sums.
  void expect(const std::vector<Real>& expected, const std::vector<Real>& magnitude) {
    Derivative d = propagate_adjoints(loss);
    Buffer<float> found = d(x).realize({n});
    for (size_t k = 0; k < expected.size(); ++k) {
      EXPECT_NEAR(found(static_cast<int>(k)), expected[k], 3e-6L * magnitude[k] + 1e-38L)
          << x(static_cast<int>(k));
    }
    expect_fact(
        d.explanations(), Fact::Zero, largest.name(),
        "the output is the same for all of its values: it only shifts or scales a softmax, a "
        "log-sum-exp or a norm, which cancels");
  }
};

TEST_F(OverFuncs, LogSumExpIsRightForValuesFarFromZeroAndFarApart) {
  loss() = largest() + log(total());
  for (float offset : {-1e4f, -90.0f, 0.0f, 90.0f, 1e4f}) {
    for (float spread : {0.0f, 1.0f, 60.0f, 1000.0f}) {
      const std::vector<Real> p = probabilities(offset, spread);
      expect(p, p);
    }
  }
}

TEST_F(OverFuncs, SoftmaxIsRightForValuesFarFromZeroAndFarApart) {
  Func share("share");
  share(i) = weight(i) / total();
  loss() = 0.0f;
  loss() += share(r) * cast<float>(r % 7);
  for (float offset : {-1e4f, -90.0f, 0.0f, 90.0f, 1e4f}) {
    for (float spread : {0.0f, 1.0f, 60.0f}) {
      std::vector<Real> p = probabilities(offset, spread), expected(p);
      Real mean = 0;
      for (size_t k = 0; k < p.size(); ++k) mean += p[k] * static_cast<Real>(k % 7);
      for (size_t k = 0; k < p.size(); ++k) expected[k] = p[k] * (static_cast<Real>(k % 7) - mean);
      std::vector<Real> magnitude(p);
      for (size_t k = 0; k < p.size(); ++k) magnitude[k] *= static_cast<Real>(k % 7) + mean;
      expect(expected, magnitude);
    }
  }
}

}  // namespace
}  // namespace retrograde::gradient

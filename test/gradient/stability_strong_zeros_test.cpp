// Tests strong zeros across Funcs: if the true derivative is finite, infinite or NaN values that the output does not
// use leave no trace in the gradient. The expected values are worked out by hand.
#include <limits>

#include "autodiff/tangents.h"
#include "gradient/gradient_check.h"
#include "graph/graph.h"

namespace retrograde::gradient {
namespace {

constexpr float inf = std::numeric_limits<float>::infinity();
const float nan = std::nanf("");

// Whether the expressions of a Func have products or quotients that are zero wherever an operand is.
bool is_strong(const graph::FuncPtr& f) {
  for (int s = 0; s < f->stage_count(); ++s) {
    const bool found = any_node(f->stage(s), [](const ir::Call& n) {
      return n.op == ir::Op::strong_mul || n.op == ir::Op::strong_div;
    });
    if (found) return true;
  }
  return false;
}

class StrongZeros : public ::testing::Test {
 protected:
  Var x{"x"};
  Buffer<float> a = Buffer<float>(4), b = Buffer<float>(4);

  void set(Buffer<float>& buffer, const std::vector<float>& values) {
    for (int i = 0; i < 4; ++i) buffer(i) = values[static_cast<size_t>(i)];
  }
  static Func sum_of(const Func& f) {
    Func loss("loss");
    RDom r(0, 4);
    loss() += f(r);
    return loss;
  }
  // Evaluates by the interpreter, as machine code, and by one tangent for each element.
  void expect(const Func& f, Buffer<float>& wrt, const std::vector<float>& expected) {
    Func loss = sum_of(f);
    Func gradient = propagate_adjoints(loss)(wrt);
    oracle::Array interpreted = evaluate(gradient, {{0}, {4}});
    Buffer<float> compiled = gradient.realize({4});
    for (int i = 0; i < 4; ++i) {
      const float e = expected[static_cast<size_t>(i)];
      EXPECT_NEAR(interpreted.at({i}).scalar.as_double(), e, 1e-5) << "element " << i;
      EXPECT_NEAR(compiled(i), e, 1e-5) << "element " << i;
      Buffer<float> unit(4);
      unit.fill(0);
      unit(i) = 1;
      EXPECT_NEAR(evaluate_scalar(propagate_tangents(loss, {{wrt, unit}})(loss)), e, 1e-5);
    }
  }
};

TEST_F(StrongZeros, ASelectInTheConsumerGuardsAChainOfFuncs) {
  set(a, {0, 1, 4, -1});
  Func logarithm("logarithm"), root("root"), product("product"), f("f");
  logarithm(x) = log(a(x));  // -inf at 0, NaN at -1
  root(x) = sqrt(a(x));
  product(x) = logarithm(x) * root(x);
  f(x) = select(a(x) > 0, product(x), 3.0f * a(x));
  expect(f, a, {3, 1, std::log(4.0f) / 4 + 0.5f, 3});
}

TEST_F(StrongZeros, AProductThatOverflowsIntoASaturatingCast) {
  set(a, {1e30f, 1, 2, 3});
  set(b, {1, 1, 1, 1});
  Func f("f");
  f(x) = cast<float>(saturating_cast(Float(16), a(x) * a(x) * b(x)));
  expect(f, b, {0, 1, 4, 9});
}

TEST_F(StrongZeros, InfiniteAndNaNInputsOfAnUnselectedFunc) {
  set(a, {inf, nan, 2, -inf});
  Func square("square"), f("f");
  square(x) = a(x) * a(x);
  f(x) = select(is_finite(a(x)), square(x), 0.0f);
  Func gradient = propagate_adjoints(sum_of(f))(a);
  Buffer<float> found = gradient.realize({4});
  for (int i = 0; i < 4; ++i) EXPECT_EQ(found(i), i == 2 ? 4.0f : 0.0f) << i;
}

// Strong products cost a comparison and a mask each, so they are used only where a factor may be infinite or NaN.
TEST_F(StrongZeros, StandOnlyWhereAFactorMayBeInfinite) {
  set(a, {1, 2, 3, -4});
  set(b, {1, 2, 3, 4});
  Buffer<uint16_t> counts(4);
  for (int i = 0; i < 4; ++i) counts(i) = static_cast<uint16_t>(i);
  const auto has_strong_zeros = [&](const Expr& factor) {
    Func f("f");
    f(x) = select(a(x) > 0, a(x) * factor, 0.0f);
    return is_strong(propagate_adjoints(sum_of(f))(a).function());
  };
  EXPECT_FALSE(has_strong_zeros(1.0f - cast<float>(x % 3) * 0.25f)) << "a weight";
  EXPECT_FALSE(has_strong_zeros(cast<float>(counts(x)))) << "an integer, whatever it is";
  EXPECT_FALSE(has_strong_zeros(select(b(x) > 1, 2.0f, 3.0f))) << "a choice between constants";
  EXPECT_TRUE(has_strong_zeros(b(x))) << "what memory holds";
  EXPECT_TRUE(has_strong_zeros(exp(cast<float>(x)))) << "a function that overflows";
  EXPECT_TRUE(has_strong_zeros(select(b(x) > 1, b(x), 3.0f))) << "a choice of what memory holds";
}

// With this promise, products fuse with the sums that they are added to.
TEST_F(StrongZeros, StandNotWhereAUserPromisesThatFactorsAreFinite) {
  ImageParam plain(Float(32), 1, "plain"), promised(Float(32), 1, "promised");
  promised.promise_finite();
  const auto has_strong_zeros = [&](const Expr& factor) {
    Func f("f");
    f(x) = select(a(x) > 0, a(x) * factor, 0.0f);
    const Func gradient = propagate_adjoints(sum_of(f))(a);
    return std::ranges::any_of(graph::topological_order({gradient.function()}), is_strong);
  };
  const auto through = [&](const Expr& value) {
    Func held("held");
    held(x) = value;
    return held(x);
  };
  EXPECT_TRUE(has_strong_zeros(plain(x)));
  EXPECT_FALSE(has_strong_zeros(promised(x)));
  EXPECT_FALSE(has_strong_zeros(promised(x) * 2.0f)) << "inside of one expression";
  Func exterior = BoundaryConditions::constant_exterior(promised, 0.0f, {{0, 4}});
  EXPECT_FALSE(has_strong_zeros(exterior(x - 1)));
  EXPECT_FALSE(has_strong_zeros(through(clamp(promised(x), -1.0f, 1.0f))));
  EXPECT_TRUE(has_strong_zeros(through(select(a(x) > 1, promised(x), plain(x)))));
  EXPECT_TRUE(has_strong_zeros(through(select(a(x) > 1, promised(x), inf))));
  EXPECT_TRUE(has_strong_zeros(through(promised(x) * promised(x)))) << "which may overflow";
  EXPECT_TRUE(has_strong_zeros(through(cast<float>(cast<float16_t>(promised(x))))));
}

TEST_F(StrongZeros, StandOnlyWhereAnInfiniteFactorMayMeetASlopeOfZero) {
  const auto has_strong_zeros = [&](const Expr& factor, bool levels_off) {
    Func held("held"), product("product"), f("f");
    held(x) = factor;
    product(x) = a(x) * held(x);
    f(x) = levels_off ? tanh(product(x)) : 3.0f * product(x);
    return is_strong(propagate_adjoints(sum_of(f))(a).function());
  };
  EXPECT_TRUE(has_strong_zeros(exp(b(x)), true));
  EXPECT_TRUE(has_strong_zeros(1.0f / b(x), true));
  EXPECT_FALSE(has_strong_zeros(exp(b(x)), false)) << "the product is infinite, too";
  EXPECT_FALSE(has_strong_zeros(1.0f / (1.0f + exp(b(x))), true)) << "at most 1";
  EXPECT_FALSE(has_strong_zeros(tanh(b(x)), true)) << "at most 1";
  EXPECT_FALSE(has_strong_zeros(b(x) * b(x), true)) << "what memory holds counts as finite";
}

TEST_F(StrongZeros, ConstantsThatAreNotFiniteWhereNobodyReads) {
  set(a, {1, 2, 3, 4});
  for (float wild : {nan, inf}) {
    Func f("f"), g("g");
    Var y("y");
    f(x, y) = a(x);
    f(2, 0) = f(2, 0) * wild;
    g(x) = f(x, 1);
    expect(g, a, {1, 1, 1, 1});
  }
}

TEST_F(StrongZeros, OverflowOfAProductInAnUnselectedFunc) {
  set(a, {1e30f, 2, 1e25f, 3});
  Func square("square"), fourth("fourth"), f("f");
  square(x) = a(x) * a(x);
  fourth(x) = square(x) * square(x);
  f(x) = select(a(x) > 100.0f, a(x), fourth(x));
  expect(f, a, {1, 32, 1, 108});
}

TEST_F(StrongZeros, OverflowOfAProductUnderAnExponential) {
  set(a, {1e30f, 2, 1e25f, 0.5f});
  set(b, {1, 2, 0.5f, 3});
  Func f("f"), g("g");
  f(x) = exp(-(a(x) * a(x)) * b(x));
  expect(f, b, {0, -4 * std::exp(-8.0f), 0, -0.25f * std::exp(-0.75f)});
  g(x) = b(x) / (1.0f + a(x) * a(x) * b(x));
  expect(g, b, {0, 1.0f / 81, 0, 1 / 1.75f / 1.75f});
}

// Squares of squares: value and tangent overflow in the Func that the exponential reads. (Adjoints detect this only
// under a user-specified seed; otherwise a product that overflows in another Func counts as finite.)
TEST_F(StrongZeros, OverflowOfAnUpdateUnderAnExponential) {
  set(a, {3, 4, 0.99f, 0.5f});
  Func power("power"), f("f");
  RDom r(0, 10);
  power(x) = a(x);
  power(x) = select(r >= 0, power(x) * power(x), 0.0f);
  f(x) = exp(-(power(x) * power(x)));
  const Func loss = sum_of(f);
  AdjointOptions options;
  options.overwritten = Overwritten::Store;
  Buffer<float> ones(4);
  ones.fill(1);
  const Buffer<float> adjoint = propagate_adjoints(f, ones, options)(a).realize({4});
  const double high = std::pow(static_cast<double>(0.99f), 2047);
  const double expected[] = {0, 0, -2048 * high * std::exp(-0.99 * high), 0};
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(adjoint(i), expected[i], 1e-5) << i;
    Buffer<float> unit(4);
    unit.fill(0);
    unit(i) = 1;
    EXPECT_NEAR(evaluate_scalar(propagate_tangents(loss, {{a, unit}})(loss)), expected[i], 1e-5);
  }
}

TEST_F(StrongZeros, SaturatedByClampAndMaximum) {
  set(a, {1e30f, 2, 0.5f, 1e20f});
  set(b, {1e30f, 0.25f, 0.5f, 1e30f});
  Func product("product"), f("f");
  product(x) = a(x) * b(x);
  f(x) = min(clamp(product(x), 0.0f, 1.0f), 0.75f);
  expect(f, a, {0, 0.25f, 0.5f, 0});
}

TEST_F(StrongZeros, ElementsThatNobodyReads) {
  set(a, {2, 1, 3, 1});
  set(b, {4, 0, 5, 0});
  Func inverse("inverse"), product("product"), f("f");
  inverse(x) = 1.0f / b(x);
  product(x) = a(x) * inverse(x);
  f(x) = product(x / 2 * 2);  // each even element twice
  expect(f, a, {0.5f, 0, 0.4f, 0});
}

TEST_F(StrongZeros, SeedsOfZero) {
  set(a, {2, 0, 3, 0});
  set(b, {1, 0, 1, 0});
  Func inverse("inverse"), product("product");
  inverse(x) = 1.0f / a(x);
  product(x) = inverse(x) * a(x) * a(x);
  Buffer<float> found = propagate_adjoints(product, b)(a).realize({4});
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(found(i), i % 2 ? 0.0f : 1.0f, 1e-6) << i;
}

// The exponential of -inf is 0, and so is its slope, which is then multiplied by infinity.
TEST_F(StrongZeros, AnInfiniteFactorThatAnotherFuncHolds) {
  set(a, {0, 0, 0, 0});
  set(b, {1, 2, 0.5f, 3});
  Func largest("largest"), f("f");
  RDom none(0, 0);
  largest() = -inf;
  largest() = max(largest(), a(none));
  f(x) = exp(largest() * b(x));
  expect(f, b, {0, 0, 0, 0});
}

TEST_F(StrongZeros, AnInfiniteFactorIsFollowedThroughFuncs) {
  set(a, {1, 0, 2, 0});
  set(b, {1, 2, 0.5f, 3});
  Func inverse("inverse"), sum("sum"), product("product"), f("f");
  RDom r(0, 2);
  inverse(x) = 1.0f / a(x);
  sum(x) = 0.0f;
  sum(x) += inverse(x) * 0.5f * cast<float>(r + 1);
  product(x) = sum(x) * b(x);
  f(x) = 1.0f / (1.0f + product(x));
  expect(f, b, {-0.24f, 0, -0.75f / 1.375f / 1.375f, 0});
}

TEST_F(StrongZeros, AnInfiniteTangentMeetsASlopeOfZero) {
  set(a, {0, 1, 2, 0.5f});
  Func f("f"), inverse("inverse"), g("g");
  f(x) = exp(-1.0f / a(x));
  const auto slope = [](float v) { return std::exp(-1 / v) / (v * v); };
  expect(f, a, {0, slope(1), slope(2), slope(0.5f)});
  inverse(x) = 1.0f / a(x);
  g(x) = exp(-inverse(x));
  expect(g, a, {0, slope(1), slope(2), slope(0.5f)});
}

TEST_F(StrongZeros, AFactorOfZeroAfterAPole) {
  set(a, {0, 1, 4, 0.25f});
  Func f("f"), root("root"), g("g");
  f(x) = a(x) * sqrt(a(x));
  expect(f, a, {0, 1.5f, 3, 0.75f});
  root(x) = sqrt(a(x));
  g(x) = root(x) * a(x);
  expect(g, a, {0, 1.5f, 3, 0.75f});
}

// f <- b(t) sqrt(f) for t = 0, 1 with b(0) = 0: the infinite adjoint of the pole at t = 1 is multiplied by a factor of
// 0 at t = 0. The last value is 0 for any initial f.
TEST_F(StrongZeros, AFactorOfZeroInAnEarlierStepThanThePole) {
  set(a, {4, 1, 9, 16});
  set(b, {0, 1, 0, 1});
  RDom t(0, 2);
  Func places("places"), scan("scan"), folded("folded");
  Var s("s");
  scan(x, s) = a(x);
  scan(x, t + 1) = b(t) * sqrt(scan(x, t));
  places(x) = x * 0;
  folded(x, s) = a(x);
  folded(x, places(t)) = b(t) * sqrt(folded(x, places(t)));
  for (const Func& f : {scan, folded}) {
    Func loss("loss");
    RDom r(0, 4);
    loss() += f(r, f.name() == scan.name() ? 2 : 0);
    Func gradient = propagate_adjoints(loss, {.overwritten = Overwritten::Store})(a);
    Buffer<float> found = gradient.realize({4});
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(found(i), 0) << f.name();
      Buffer<float> unit(4);
      unit.fill(0);
      unit(i) = 1;
      EXPECT_EQ(evaluate_scalar(propagate_tangents(loss, {{a, unit}})(loss)), 0) << f.name();
    }
  }
}

// 1 / a overflows.
TEST_F(StrongZeros, AFactorOfZeroAfterAQuotient) {
  set(a, {1e-45f, 2, -3, 0.25f});
  Func shrunk("shrunk");
  shrunk(x) = a(x) / abs(a(x)) * max(abs(a(x)) - 0.5f, 0.0f);
  expect(shrunk, a, {0, 1, 1, 0});
}

// Taken term by term, infinite adjoints of both signs reach f.
TEST_F(StrongZeros, ATermThatCancelsBehindAPole) {
  set(a, {1, 0, -3, 2});
  set(b, {1, 2, 4, 9});
  Func held("held"), nothing("nothing"), rest("rest");
  held(x) = 3.0f * a(x);
  nothing(x) = pow(held(x) - held(x), 0.5f);
  expect(nothing, a, {0, 0, 0, 0});
  rest(x) = sqrt((b(x) + held(x)) - (1.0f + held(x)));
  expect(rest, a, {0, 0, 0, 0});
}

TEST_F(StrongZeros, AnInfiniteFactorOfAMaximumThatIsConstant) {
  set(a, {-1, 2, -3, 4});
  set(b, {inf, 3, -inf, 5});
  Func f("f");
  f(x) = max(a(x), 0.0f) * b(x);
  expect(f, a, {0, 3, 0, 5});
}

// Sums in registers try plain products first. Rows of seeds that are 0 are multiplied by infinities and NaNs, at sizes
// that tiles divide and sizes that they do not.
TEST_F(StrongZeros, SumsOfProductsInRegisters) {
  for (const int size : {64, 45}) {
    Buffer<float> weight(size, size), image(size, size), seed(size, size);
    weight.for_each_element([&](int k, int y) {
      weight(k, y) = y % 8 == 3 ? (k % 2 ? inf : nan) : static_cast<float>((k * 7 + y * 5) % 9 - 4);
    });
    seed.for_each_element([&](int x, int y) {
      seed(x, y) = y % 8 == 3 ? 0.0f : static_cast<float>((x * 3 + y) % 5 - 2);
    });
    image.fill(1);
    Var y("y");
    RDom k(0, size, "k");
    Func product("product");
    product(x, y) = 0.0f;
    product(x, y) += weight(k, y) * image(x, k);
    Buffer<float> found = propagate_adjoints(product, seed)(image).realize({size, size});
    found.for_each_element([&](int x, int k) {
      float expected = 0;
      for (int row = 0; row < size; ++row)
        expected += row % 8 == 3 ? 0.0f : seed(x, row) * weight(k, row);
      ASSERT_EQ(found(x, k), expected) << x << " " << k;
    });
    seed(5, 3) = 1;  // now it does meet them
    found = propagate_adjoints(product, seed)(image).realize({size, size});
    found.for_each_element([&](int x, int k) {
      ASSERT_EQ(std::isnan(found(x, k)), x == 5 && k % 2 == 0) << x << " " << k;
      ASSERT_EQ(std::isinf(found(x, k)), x == 5 && k % 2 == 1) << x << " " << k;
    });
  }
}

// The adjoint of the image adds up a product for each of two Funcs that read it.
TEST_F(StrongZeros, SumsOfSeveralProductsInRegisters) {
  for (const int size : {64, 45}) {
    Buffer<float> first(size, size), second(size, size), image(size, size), seed(size, size);
    first.for_each_element([&](int k, int y) {
      first(k, y) = y % 8 == 3 ? (k % 2 ? inf : nan) : static_cast<float>((k * 7 + y * 5) % 9 - 4);
      second(k, y) = static_cast<float>((k + y * 3) % 7 - 3);
    });
    seed.for_each_element([&](int x, int y) {
      seed(x, y) = y % 8 == 3 ? 0.0f : static_cast<float>((x * 3 + y) % 5 - 2);
    });
    image.fill(1);
    Var y("y");
    RDom k(0, size, "k");
    Func a("a"), b("b"), both("both");
    a(x, y) = 0.0f;
    a(x, y) += first(k, y) * image(x, k);
    b(x, y) = 0.0f;
    b(x, y) += second(k, y) * image(x, k);
    both(x, y) = a(x, y) + b(x, y);
    const Buffer<float> found = propagate_adjoints(both, seed)(image).realize({size, size});
    found.for_each_element([&](int x, int k) {
      float expected = 0;
      for (int row = 0; row < size; ++row)
        expected += row % 8 == 3 ? 0.0f : seed(x, row) * (first(k, row) + second(k, row));
      ASSERT_EQ(found(x, k), expected) << x << " " << k;
    });
  }
}

TEST_F(StrongZeros, NaNsThatTheOutputUsesStay) {
  set(a, {-1, 4, 1, 1});
  set(b, {2, 2, 2, 2});
  Func root("root"), f("f");
  root(x) = sqrt(a(x));
  f(x) = select(b(x) > 1, root(x) * b(x), 0.0f);
  Buffer<float> found = propagate_adjoints(sum_of(f))(a).realize({4});
  EXPECT_TRUE(std::isnan(found(0)));
  EXPECT_NEAR(found(1), 0.5f, 1e-6);
}

}  // namespace
}  // namespace retrograde::gradient

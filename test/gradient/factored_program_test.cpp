// Tests gradients of programs with costly factors of sums: the exponentials of a gradient run once for each of their
// arguments, and the gradient is that of the program as it was written.
#include "autodiff/sweeps/factored_program.h"

#include <string>
#include <vector>

#include "gradient/gradient_check.h"
#include "support/facts.h"
#include "support/variables.h"

namespace retrograde::gradient {
namespace {

constexpr int bins = 8, samples = 128, knots = 6;

const Var a("a"), b("b");

Expr closeness(const Expr& value, const Expr& bin) {
  const Expr apart = value * static_cast<float>(bins - 1) - cast<float>(bin);
  return exp(-0.5f * apart * apart);
}

// The joint histogram of two signals, each of which repeats a few knots.
struct Histogram {
  Buffer<float> first = random_image({knots}, 0, 1, 1), second = random_image({knots}, 0, 1, 2);
  RDom r{0, samples, "r"}, s{0, bins, 0, bins, "s"};
  Func counts{"counts"}, joint{"joint"}, total{"total"};
  explicit Histogram(bool is_scheduled = false) {
    counts(a, b) = 0.0f;
    counts(a, b) += closeness(first(r % knots), a) * closeness(second(r * 5 % knots), b);
    if (is_scheduled) counts.compute_root();
    joint(a, b) = counts(a, b) * 0.0625f + 1e-3f;
    total() = 0.0f;
    total() += joint(s.x, s.y) * log(joint(s.x, s.y));
  }
};

double exponentials(const Derivative& d) {
  return d.operations().gradient.nonlinear().value().value_or(-1);
}
bool has_factors(const Derivative& d) {
  return std::ranges::any_of(
      d.funcs(), [](const Func& f) { return f.name().find("_factor") != std::string::npos; });
}

TEST(FactoredProgram, ExponentialsOfAGradientRunOnceForTheirArguments) {
  Histogram h, scheduled(true);
  const Derivative d = propagate_adjoints(h.total), before = propagate_adjoints(scheduled.total);
  ASSERT_TRUE(has_factors(d));
  EXPECT_FALSE(has_factors(before)) << "a Func with directives is left alone";
  EXPECT_LE(exponentials(d), 2 * (2 * bins * samples + bins * bins))
      << "of the factors and their derivatives, and logarithms of the joint";
  EXPECT_GT(exponentials(before), 4 * bins * bins * samples);
  expect_fact(d.explanations(), Fact::Version, h.counts.name(),
              "\"counts_factor\" keeps a factor of its terms, which depends on (a, x) alone");
}

TEST(FactoredProgram, GradientsAreThoseOfTheProgram) {
  Histogram h;
  const Derivative d = propagate_adjoints(h.total);
  expect_gradient(h.total, d, h.first);
  expect_gradient(h.total, d, h.second);
}

TEST(FactoredProgram, RequestedAdjointsOfTheUsersFuncsAreFound) {
  Histogram h, other(true);
  const Derivative d = propagate_adjoints(h.total, {.wrt = {h.counts, h.joint, h.first}});
  const Derivative expected =
      propagate_adjoints(other.total, {.wrt = {other.counts, other.joint, other.first}});
  ASSERT_TRUE(has_factors(d));
  const oracle::Region all{{0, 0}, {bins, bins}};
  for (const auto& [f, g] : {std::pair(h.counts, other.counts), {h.joint, other.joint}}) {
    const oracle::Array found = evaluate(d(f), all), wanted = evaluate(expected(g), all);
    all.for_each([&](const std::vector<int>& point) {
      EXPECT_DOUBLE_EQ(found.at(point).scalar.as_double(), wanted.at(point).scalar.as_double());
    });
  }
}

// The gradient reads the Funcs that the user has handles of.
TEST(FactoredProgram, DirectivesThatFollowHaveTheirEffect) {
  Histogram h;
  const Derivative d = propagate_adjoints(h.total);
  bool reads_counts = false;
  for (const graph::FuncPtr& f : graph::topological_order({d(h.first).function()}))
    reads_counts |= f == h.counts.function();
  EXPECT_TRUE(reads_counts);
  h.counts.compute_root().vectorize(a, 4);
  const Buffer<float> gradient = Func(d(h.first)).realize({knots});
  Histogram other(true);
  const Buffer<float> expected =
      Func(propagate_adjoints(other.total)(other.first)).realize({knots});
  for (int i = 0; i < knots; ++i)
    EXPECT_NEAR(gradient(i), expected(i), 1e-4f * (1 + std::abs(expected(i))));
}

// Points with separable weights, scattered on a grid: the weights along x and y are matrices.
TEST(FactoredProgram, SeparableKernelsOfPoints) {
  Buffer<float> at = random_image({4, 2}, 0, 1, 3), weight = random_image({4}, 0.25, 2, 4);
  Func image("image");
  Var y("y");
  RDom r(0, 16, "r");
  const auto kernel = [&](const Expr& place, int d) {
    const Expr apart = cast<float>(place) * 0.0625f - at(r % 4, d);
    return exp(-8.0f * apart * apart);
  };
  image(x, y) = 0.0f;
  image(x, y) += kernel(x, 0) * kernel(y, 1) * weight(r % 4);
  const Func loss = weighted_sum(image, {24, 20});
  const Derivative d = propagate_adjoints(loss);
  ASSERT_TRUE(has_factors(d));
  expect_gradient(loss, d, at);
  expect_gradient(loss, d, weight);
}

// A power is a factor of the terms, its exponent another input.
TEST(FactoredProgram, PowersWithADirectiveOnAConsumer) {
  Buffer<float> base = random_image({6}, 0.25, 2, 5), exponent = random_image({3}, 0.5, 2, 6);
  Func sums("sums");
  RDom r(0, 96, "r");
  sums(a, b) = 0.0f;
  sums(a, b) += pow(base(r % 6), exponent(a % 3)) * sin(base((r + b) % 6));
  const Func loss = weighted_sum(sums, {12, 12});
  Func(loss).compute_root();
  const Derivative d = propagate_adjoints(loss);
  ASSERT_TRUE(has_factors(d));
  expect_gradient(loss, d, base);
  expect_gradient(loss, d, exponent);
}

// A pipeline of the output and its gradient has the factors once.
TEST(FactoredProgram, FactorsOfTheOutputAreThoseOfTheGradient) {
  Histogram h;
  const Derivative d = propagate_adjoints(h.total);
  const auto factors_in = [](const std::vector<graph::FuncPtr>& outputs) {
    return std::ranges::count_if(graph::topological_order(outputs), [](const graph::FuncPtr& f) {
      return transform::is_invariant_factor(*f);
    });
  };
  const std::vector<graph::FuncPtr> outputs{h.total.function(), d(h.first).function()};
  const std::vector<graph::FuncPtr> compiled = transform::with_invariant_factors(outputs);
  EXPECT_EQ(factors_in({compiled[0]}), 2);
  EXPECT_EQ(factors_in(compiled), 2);
}

// Sizes of an output with a seed are those of the seed.
TEST(FactoredProgram, BoundsOfAnOutputGiveTheSizes) {
  Histogram h;
  Func seed("seed");
  seed(a, b) = cast<float>(a + 2 * b);
  EXPECT_TRUE(has_factors(propagate_adjoints(h.counts, seed, {{0, bins}, {0, bins}})));
  EXPECT_FALSE(has_factors(propagate_adjoints(h.counts, seed, {{0, 2}, {0, 2}})));
}

}  // namespace
}  // namespace retrograde::gradient

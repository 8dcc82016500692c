// Long linear recurrences run in blocks: which do, and their results and gradients against the same program in order
// and in double precision, on several threads.
#include "transform/blocked_recurrences.h"

#include <gtest/gtest.h>

#include "driver/schedule.h"
#include "frontend/data/image_param.h"
#include "frontend/run/pipeline.h"
#include "gradient/gradient_check.h"
#include "graph/copy_graph.h"
#include "graph/graph.h"

namespace retrograde {
namespace {

using graph::FuncPtr;
using transform::SumOrder;

bool has_blocks(const Func& f, SumOrder order = SumOrder::Free) {
  return transform::has_blocked_recurrences({f.function()}, order);
}

Func in_blocks(const Func& f) {
  const std::vector<FuncPtr> copy = graph::copy_graph({f.function()}).outputs;
  transform::run_in_blocks(copy, SumOrder::Free);
  EXPECT_FALSE(transform::has_blocked_recurrences(copy, SumOrder::Free));
  Func result(copy[0]);
  Pipeline(result).auto_schedule(get_host_target());
  return result;
}

// The largest difference, in units of the largest magnitude in double precision.
double error_of(const Buffer<float>& found, const oracle::Array& exact) {
  double error = 0, magnitude = 0;
  size_t i = 0;
  const_cast<Buffer<float>&>(found).for_each_value([&](const float& value) {
    const double expected = exact.values[i++].scalar.as_double();
    error = std::max(error, std::isnan(value) ? INFINITY : std::abs(value - expected));
    magnitude = std::max(magnitude, std::abs(expected));
  });
  return error / magnitude;
}

// In blocks it is as exact as in order, and has the same bits on any number of threads.
void expect_as_exact(const Func& f, const std::vector<int>& sizes) {
  const oracle::Region region{std::vector<int>(sizes.size()), sizes};
  const oracle::Array exact = gradient::evaluate(f, region);
  Func in_order = f, blocked = in_blocks(f);
  const Buffer<float> first = gradient::run_on_threads(blocked, region, 1, false);
  const double limit = error_of(gradient::run_on_threads(in_order, region, 1, false), exact);
  EXPECT_LE(error_of(first, exact), 2 * limit + 2e-7);
  for (const int threads : {2, 5})
    EXPECT_TRUE(
        gradient::same_bits(first, gradient::run_on_threads(blocked, region, threads, true)));
}

struct BlockedRecurrences : ::testing::Test {
  static constexpr int n = 5000;

  BlockedRecurrences() {
    image = gradient::random_image({n + 4}, -1, 1, 7);
    y(x) = image(clamp(x, 0, n + 3));
  }
  void first_order(const Expr& a) { y(r.x) = y(r.x) + a * y(r.x - 1); }
  void second_order(const Expr& a, const Expr& b) {
    y(r.x) = y(r.x) + a * y(r.x - 1) + b * y(r.x - 2);
  }

  Var x{"x"}, c{"c"};
  Func y{"y"};
  RDom r{2, n, "r"};
  Buffer<float> image;
};

// ---- which updates ----

TEST_F(BlockedRecurrences, AreTheUsersIfSumsMayBeReordered) {
  first_order(0.5f);
  EXPECT_TRUE(has_blocks(y));
  EXPECT_FALSE(has_blocks(y, SumOrder::Kept));
}

TEST_F(BlockedRecurrences, AreLongAndOfFewSignals) {
  r = RDom(1, 1000, "r");
  first_order(0.5f);
  EXPECT_FALSE(has_blocks(y)) << "too short";
  for (const int signals : {3, 64}) {
    Func many("many");
    RDom s(1, n, "s");
    many(x, c) = image(clamp(x, 0, n)) * c;
    many(s.x, c) = many(s.x, c) + many(s.x - 1, c) * 0.5f;
    many.bound(c, 0, signals);
    EXPECT_EQ(has_blocks(many), signals == 3);
  }
}

TEST_F(BlockedRecurrences, AreLinear) {
  const auto is_one = [&](const std::function<Expr(Expr, Expr, Expr)>& value) {
    Func f("f");
    f(x) = image(clamp(x, 0, n));
    f(r.x) = value(f(r.x), f(r.x - 1), f(r.x - 2));
    return has_blocks(f);
  };
  const auto at = [&](int lag) { return image(clamp(r.x - lag, 0, n)); };
  EXPECT_TRUE(is_one([&](Expr f, Expr f1, Expr) { return f1 + 0.1f * (at(0) - f1); }));
  EXPECT_TRUE(is_one([&](Expr f, Expr f1, Expr f2) { return (at(0) - f1 / 3.0f) - 0.5f * f2; }));
  EXPECT_TRUE(is_one([&](Expr f, Expr f1, Expr f2) { return exp(at(1)) + f + f2; }));
  EXPECT_FALSE(is_one([&](Expr f, Expr f1, Expr) { return f * f + f1; }));
  EXPECT_FALSE(is_one([&](Expr f, Expr f1, Expr) { return f + f1 * at(1); }))
      << "of changing coefficients";
  EXPECT_FALSE(is_one([&](Expr f, Expr f1, Expr) { return max(f, f1); }));
  EXPECT_FALSE(is_one([&](Expr f, Expr f1, Expr f2) { return f + f1 * f2; }));
  EXPECT_FALSE(is_one([&](Expr f, Expr f1, Expr) { return f + sin(f1); }));
  EXPECT_FALSE(is_one([&](Expr f, Expr, Expr) { return f + at(1); })) << "no recurrence";
}

TEST_F(BlockedRecurrences, ReadTheOneOrTwoElementsBefore) {
  Func third("third"), ahead("ahead"), places("places"), scheduled("scheduled");
  third(x) = image(clamp(x, 0, n));
  third(r.x) = third(r.x) + 0.5f * third(max(r.x - 3, 0));
  EXPECT_FALSE(has_blocks(third));
  ahead(x) = image(clamp(x, 0, n));
  ahead(r.x) = 0.5f * ahead(r.x + 1) + 0.5f * ahead(r.x - 1);
  EXPECT_FALSE(has_blocks(ahead));
  places(x) = image(clamp(x, 0, n));
  places(r.x) = places(clamp(cast<int>(image(r.x)), 0, r.x - 1)) * 0.5f;
  EXPECT_FALSE(has_blocks(places));
  scheduled(x) = image(clamp(x, 0, n));
  scheduled(r.x) = scheduled(r.x) + 0.5f * scheduled(r.x - 1);
  scheduled.compute_root();
  EXPECT_FALSE(has_blocks(scheduled));
}

// ---- results ----

TEST_F(BlockedRecurrences, OfFirstOrder) {
  for (const float a : {0.9f, -0.99f, 1.0f, 1e-3f, 0.0f}) {
    SCOPED_TRACE(a);
    y = Func("y");
    y(x) = image(clamp(x, 0, n + 3));
    first_order(a);
    EXPECT_TRUE(has_blocks(y));
    expect_as_exact(y, {n + 4});
  }
}

TEST_F(BlockedRecurrences, OfAMovingAverage) {
  y(r.x) = y(r.x - 1) + 1e-3f * (image(r.x) + 3.0f - y(r.x - 1));
  expect_as_exact(y, {n + 4});
}

// A slow resonator, whose poles lie at 0.9999 on both sides of the real axis, and a critically damped one.
TEST_F(BlockedRecurrences, OfSecondOrder) {
  for (const auto& [radius, angle] : {std::pair(0.9999, 0.01), {0.999, 0.0}, {0.5, 1.5}}) {
    SCOPED_TRACE(text(radius, " ", angle));
    y = Func("y");
    y(x) = image(clamp(x, 0, n + 3));
    second_order(static_cast<float>(2 * radius * std::cos(angle)),
                 static_cast<float>(-radius * radius));
    EXPECT_TRUE(has_blocks(y));
    expect_as_exact(y, {n + 4});
  }
}

TEST_F(BlockedRecurrences, Backward) {
  const Expr i = n + 1 - r.x;
  y(i) = y(i) + 0.75f * y(i + 1) - 0.5f * y(i + 2);
  EXPECT_TRUE(has_blocks(y));
  expect_as_exact(y, {n + 4});
}

TEST_F(BlockedRecurrences, OfAFewSignalsWithTheirOwnCoefficients) {
  Func many("many"), a("a");
  a(c) = 0.5f + 0.2f * cast<float>(c);
  many(x, c) = image(clamp(x, 0, n + 3)) * (c + 1);
  many(r.x, c) = many(r.x, c) + a(c) * many(r.x - 1, c) - 0.125f * many(r.x - 2, c);
  many.bound(c, 0, 2);
  EXPECT_TRUE(has_blocks(many));
  expect_as_exact(many, {n + 4, 2});
}

TEST_F(BlockedRecurrences, AlongTheSecondDimension) {
  Func f("f");
  f(c, x) = image(clamp(x, 0, n + 3)) + c;
  f(c, r.x) = f(c, r.x) - 0.5f * f(c, r.x - 1);
  f.bound(c, 0, 2);
  EXPECT_TRUE(has_blocks(f));
  expect_as_exact(f, {2, n + 4});
}

TEST_F(BlockedRecurrences, BetweenOtherUpdates) {
  y(r.x) = y(r.x) * 2.0f;
  first_order(0.5f);
  y(r.x) = 0.25f * y(r.x) - y(r.x - 1);
  expect_as_exact(y, {n + 4});
}

// With a length that nobody knows: none, shorter than a block, whole blocks, more.
TEST_F(BlockedRecurrences, OfAnyLength) {
  Param<int> length("length");
  for (const int count : {0, 1, 2, 255, 256, 257, 512, 1000}) {
    SCOPED_TRACE(count);
    length.set(count);
    Func f("f");
    f(x) = image(clamp(x, 0, n + 3));
    RDom s(2, length, "s");
    f(s.x) = f(s.x) + 0.9f * f(s.x - 1) - 0.2f * f(s.x - 2);
    EXPECT_TRUE(has_blocks(f));
    expect_as_exact(f, {1010});
  }
}

// Reads the last element alone, from an image that is exactly as long as the recurrence.
TEST_F(BlockedRecurrences, ReadNothingOutsideOfImages) {
  ImageParam in(Float(32), 1, "in");
  Func f("f"), last("last");
  f(x) = 0.0f;
  RDom s(0, in.width(), "s");
  f(s.x + 1) = in(s.x) + 0.5f * f(s.x);
  last(x) = f(in.width() - x);
  Func fast = in_blocks(last);
  for (const int length : {300, 5000}) {
    Buffer<float> values = gradient::random_image({length}, -1, 1, 3);
    in.set(values);
    const Buffer<float> expected = last.realize({5}), found = fast.realize({5});
    for (int i = 0; i < 5; ++i) EXPECT_NEAR(found(i), expected(i), 1e-6);
  }
}

// In order, silence stays silent whatever the coefficients, and what grows overflows where it does.
TEST_F(BlockedRecurrences, OfAnUnstableFilterGrowAsTheyDoInOrder) {
  image.fill(0.0f);
  image(n - 50) = 1.0f;
  second_order(2.0f, 1.0f);
  Func fast = in_blocks(y);
  const Buffer<float> expected = y.realize({n + 4}), found = fast.realize({n + 4});
  EXPECT_EQ(found(n - 51), 0.0f);
  EXPECT_GT(found(n), 1e15f);
  for (int i = 0; i < n + 4; ++i) EXPECT_NEAR(found(i), expected(i), 1e-5f * expected(i)) << i;

  image(10) = 1.0f;
  EXPECT_FALSE(std::isfinite(Buffer<float>(fast.realize({n + 4}))(n)));
}

TEST_F(BlockedRecurrences, KeepNaN) {
  first_order(0.5f);
  image(700) = NAN;
  Func fast = in_blocks(y);
  const Buffer<float> found = fast.realize({n + 4});
  for (int i = 0; i < n + 2; ++i) EXPECT_EQ(std::isnan(found(i)), i >= 700) << i;
}

// ---- gradients ----

std::vector<std::string> funcs_in_blocks(const Func& gradient) {
  std::vector<std::string> result;
  for (const FuncPtr& f :
       graph::topological_order(driver::schedule_unscheduled({gradient.function()}))) {
    if (f->made && f->made->role == graph::Role::SharedValue) result.push_back(f->made->of);
  }
  return result;
}

TEST_F(BlockedRecurrences, OfAdjointsAreRightAndAsExact) {
  Buffer<float> a(2);
  a(0) = 1.2f;
  a(1) = -0.4f;
  second_order(a(Expr(0)), a(Expr(1)));
  const Func loss = gradient::weighted_sum(y, {n + 4});
  const Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(funcs_in_blocks(d(image)).size(), 1U) << "the recurrence itself keeps its order";
  for (const auto& [gradient, size] : {std::pair(d(image), n + 4), {d(a), 2}}) {
    const oracle::Region region{{0}, {size}};
    const oracle::Array exact = gradient::evaluate(gradient, region);
    Func run = gradient;
    const Buffer<float> first = gradient::run_on_threads(run, region, 1, false);
    EXPECT_LE(error_of(first, exact), 1e-6);
    EXPECT_TRUE(gradient::same_bits(first, gradient::run_on_threads(run, region, 3, true)));
  }
}

}  // namespace
}  // namespace retrograde

// Tests forward mode: tangents of complete programs, element by element, against central differences in double along
// the direction, and as machine code. Covers every kind of update, inputs of every kind, and errors.
#include "autodiff/tangents.h"
#include "frontend/data/param.h"
#include "gradient/gradient_check.h"
#include "support/errors.h"
#include "support/facts.h"
#include "support/variables.h"

namespace retrograde::gradient {
namespace {

constexpr int n = 8;

class TangentsTest : public ::testing::Test {
 protected:
  Buffer<float> a = random_image({n}, 0.25, 2, 1), v = random_image({n}, -1, 1, 2);
  Buffer<float> image = random_image({n, 5}, 0.25, 2, 3), v2 = random_image({n, 5}, -1, 1, 4);
};

// (f(a + h v) - f(a - h v)) / 2h, Richardson extrapolated; every element.
std::vector<double> differences(const Func& f, Buffer<float>& a, const Buffer<float>& v,
                                const oracle::Region& region, size_t element) {
  auto at = [&](float h) {
    Buffer<float> kept = a.copy();
    a.get()->for_each_element(
        [&](const int* i) { (*a.get())(i) = (*kept.get())(i) + h * (*v.get())(i); });
    oracle::InterpreterOptions options;
    options.widen = true;
    auto out = oracle::Interpreter(options).realize(f.function(), region)[element];
    a.get()->for_each_element([&](const int* i) { (*a.get())(i) = (*kept.get())(i); });
    std::vector<double> result;
    for (const oracle::Value& value : out.values) result.push_back(value.scalar.as_double());
    return result;
  };
  auto slope = [&](float h) {
    std::vector<double> up = at(h), down = at(-h);
    for (size_t i = 0; i < up.size(); ++i) up[i] = (up[i] - down[i]) / (2.0 * h);
    return up;
  };
  std::vector<double> coarse = slope(1.0f / 256), fine = slope(1.0f / 512);
  for (size_t i = 0; i < fine.size(); ++i) fine[i] = (4 * fine[i] - coarse[i]) / 3;
  return fine;
}

void expect_tangent(const Func& f, Buffer<float>& a, const Buffer<float>& v,
                    const std::vector<int>& sizes, size_t element = 0) {
  Tangents t = propagate_tangents(f, {{a, v}});
  Func forward = t(f);
  const oracle::Region region{std::vector<int>(sizes.size(), 0), sizes};
  oracle::InterpreterOptions options;
  options.widen = true;
  oracle::Array found = oracle::Interpreter(options).realize(forward.function(), region)[element];
  std::vector<double> expected = differences(f, a, v, region, element);
  double largest = 0;
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(found.values[i].scalar.as_double(), expected[i], 1e-5 * (1 + std::abs(expected[i])))
        << "element " << i << "\n"
        << t.explain(Detail::All);
    largest = std::max(largest, std::abs(expected[i]));
  }
  EXPECT_GT(largest, 1e-3) << "this program does not move";
  if (forward.outputs() == 1) expect_machine_code_agrees(forward, region);
}

TEST_F(TangentsTest, PointwiseStencilsAndReductions) {
  Func f("f"), g("g"), h("h");
  RDom r(0, 3);
  f(x) = sin(a(clamp(x, 0, n - 1))) * a(clamp(x - 1, 0, n - 1));
  g(x) = sum(f(x + r) * cast<float>(r + 1));
  h(x) = g(x) / (1.0f + f(2 * x / 3)) + exp(-g(x + 1) * 0.1f);
  expect_tangent(h, a, v, {n});
}

TEST_F(TangentsTest, PartialOverwrites) {
  Func f("f");
  f(x) = a(x) * a(x);
  f(3) = 2.0f;  // a constant: the tangent is overwritten with 0
  f(x) += a((x + 1) % n);
  f(5) = sin(a(2));
  expect_tangent(f, a, v, {n});
}

TEST_F(TangentsTest, NonlinearScanReadsWhatItOverwrites) {
  Func f("f");
  RDom r(2, n - 2);
  f(x) = a(x);
  f(r) = sin(f(r - 1)) * f(r - 2) * 0.5f + f(r) * f(r) * 0.25f;
  expect_tangent(f, a, v, {n});
}

TEST_F(TangentsTest, BackwardScanOfTwoDimensions) {
  Func f("f");
  RDom r(1, n - 1);
  f(x, y) = image(x, y);
  f(n - 1 - r, y) = tanh(f(n - r, y) + image(n - 1 - r, y)) * image(r, y);
  expect_tangent(f, image, v2, {n, 5});
}

TEST_F(TangentsTest, InPlaceProductAndMaximum) {
  Func product("product"), largest("largest"), chosen("chosen");
  RDom r(0, n);
  product() = 1.0f;
  product() *= a(r);
  largest() = 0.0f;
  largest() = max(largest(), a(r) * cast<float>(1 + r % 3));
  chosen(x) = product() * a(x) + largest();
  expect_tangent(chosen, a, v, {n});
}

TEST_F(TangentsTest, ArgmaxMovesWithTheChosenElement) {
  RDom r(0, n);
  Tuple best = argmax(a(r) + cast<float>(r % 3));  // no ties
  Func f("f");
  f(x) = best[1] * a(x) + a(clamp(best[0], 0, n - 1));
  expect_tangent(f, a, v, {n});
}

TEST_F(TangentsTest, CoupledTuples) {
  Func f("f");
  RDom r(1, n - 1);
  f(x) = {a(x), cos(a(x))};
  f(r) = {f(r - 1)[1] * f(r)[0], f(r - 1)[0] + f(r)[1] * f(r)[1]};
  expect_tangent(f, a, v, {n}, 0);
  expect_tangent(f, a, v, {n}, 1);
}

TEST_F(TangentsTest, SwapInPlace) {
  Func f("f");
  RDom r(0, n / 2);
  f(x) = a(x) * a(x);
  f(r) = f(n - 1 - r) * f(r);
  expect_tangent(f, a, v, {n});
}

TEST_F(TangentsTest, HistogramAtDataDependentPlaces) {
  Func f("f");
  RDom r(0, n);
  Expr bin = clamp(cast<int>(a(r) * 3.0f), 0, 5);
  f(x) = 1.0f;
  f(bin) *= 1.0f + a(r) * a(r);
  f(bin) += sin(a(r));
  expect_tangent(f, a, v, {6});
}

TEST_F(TangentsTest, PlaceThatDependsOnTheFuncItself) {
  Func f("f");
  RDom r(0, n - 1);
  f(x) = a(x);
  f(clamp(cast<int>(f(r) * 4.0f), 0, n - 1)) += f(r + 1) * 0.5f;
  expect_tangent(f, a, v, {n});
}

TEST_F(TangentsTest, PredicatesAndUndef) {
  Func f("f");
  RDom r(0, n, 0, n);
  r.where(r.x < r.y);
  f(x) = undef<float>();
  f(x) = a(x) * 2.0f;
  f(r.x) += a(r.y) * a(r.x);
  f(x) = select(x % 2 == 0, undef<float>(), a(x) * a(x));
  f(x) = select(x == 3, 1.0f, undef<float>());
  expect_tangent(f, a, v, {n});
}

TEST_F(TangentsTest, ConvertedAndNarrowTypes) {
  Func f("f"), g("g");
  f(x) = cast<double>(a(x)) * a(x) + floor(a(x));
  g(x) = cast<float>(f(x) * f(x));
  expect_tangent(g, a, v, {n});
}

TEST_F(TangentsTest, ImageParamsParamsAndFuncsMove) {
  ImageParam in(Float(32), 1);
  Param<float> gain("gain");
  Func base("base"), f("f"), base_direction("base_direction"), gain_direction("gain_direction");
  in.set(a);
  gain.set(1.5f);
  base(x) = in(x);
  base(x) += 1.0f;
  f(x) = base(x) * base(x) * gain + in(x);
  base_direction(x) = cast<float>(x);
  gain_direction() = 2.0f;
  Func moved = propagate_tangents(f, {{in, v}, {gain, gain_direction}, {base, base_direction}})(f);
  oracle::Array found = evaluate(moved, {{0}, {n}});
  for (int i = 0; i < n; ++i) {
    double b = a(i) + 1, tan = v(i) + i;
    EXPECT_NEAR(found.at({i}).scalar.as_double(), 2 * b * tan * 1.5 + b * b * 2 + v(i), 1e-9);
  }
}

TEST_F(TangentsTest, SecondTangentsAreSecondDerivatives) {
  Func f("f");
  f(x) = a(x) * a(x) * a(x) + a(0) * a(x);
  Func first = propagate_tangents(f, {{a, v}})(f);
  expect_tangent(first, a, v, {n});
}

TEST_F(TangentsTest, WhatDoesNotMoveIsZeroAndSaysSo) {
  Func constant("constant"), rounded("rounded"), f("f"), elsewhere("elsewhere");
  constant(x) = cast<float>(x);
  rounded(x) = floor(a(x));
  f(x) = constant(x) + rounded(x) + a(x);
  elsewhere(x) = a(x);
  Tangents t = propagate_tangents(f, {{a, v}});
  EXPECT_EQ(evaluate(t(constant), {{0}, {n}}).at({3}).scalar.as_double(), 0);
  EXPECT_EQ(evaluate(t(rounded), {{0}, {n}}).at({3}).scalar.as_double(), 0);
  expect_fact(t.explanations(), Fact::Zero, rounded.name(),
              "floor has derivative 0 (constant between steps; 0 at the steps by convention)");
  EXPECT_FALSE(t(elsewhere).defined());
}

TEST_F(TangentsTest, ErrorsNameWhatIsWrong) {
  Func f("f"), integer("integer"), wide("wide_direction"), empty("empty"), pair("pair_direction");
  f(x) = a(x);
  integer(x) = cast<int>(a(x));
  wide(x, y) = 1.0f;
  pair(x) = {1.0f, 2.0f};
  auto message = [](const auto& run) { return error_of(run); };
  expect_mentions(message([&] { propagate_tangents(f, {}); }), {"there is no direction"});
  expect_mentions(message([&] { propagate_tangents(integer, {{a, v}}); }), {"int32"});
  expect_mentions(message([&] {
                    propagate_tangents(f, {{a, wide}});
                  }),
                  {"\"wide_direction\" has 2"});
  expect_mentions(message([&] { propagate_tangents(f, {{a, empty}}); }), {"no definition"});
  expect_mentions(message([&] {
                    propagate_tangents(f, {{a, pair}});
                  }),
                  {"\"pair_direction\" has 2"});
  expect_mentions(message([&] { propagate_tangents(f, {{a, integer}}); }), {"has type int32"});
  expect_mentions(message([&] { propagate_tangents(f, {{a, v}, {a, v}}); }), {"there are two"});
  expect_mentions(message([&] { propagate_tangents(empty, {{a, v}}); }), {"no definition"});
}

TEST_F(TangentsTest, UndefInsideAnOperationIsRefused) {
  Func f("f");
  f(x) = a(x);
  f(x) = select(x > 3, undef<float>(), a(x)) * 2.0f;
  EXPECT_THROW(propagate_tangents(f, {{a, v}}), Unsupported);
}

}  // namespace
}  // namespace retrograde::gradient

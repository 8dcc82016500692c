// Tests that check_stability finds pipelines built to be unstable, names the unstable Func, and reports nothing for
// stable ones.
#include <map>
#include <nlohmann/json.hpp>

#include "checks/check_stability.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"
#include "gradient/gradient_check.h"
#include "support/errors.h"

namespace retrograde::gradient {
namespace {

class CheckStability : public ::testing::Test {
 protected:
  Var x{"x"};
  Buffer<float> a = random_image({16}, 0.25, 2, 1);
  ImageParam image{Float(32), 1, "image"};
  void SetUp() override { image.set(a); }

  static const StabilityReport::FuncResult& result(const StabilityReport::Case& c,
                                                   const std::string& name, bool is_adjoint) {
    for (const auto& f : c.funcs) {
      if (f.name == name && f.is_adjoint == is_adjoint) return f;
    }
    throw std::runtime_error("no result of " + name);
  }
};

TEST_F(CheckStability, OverflowOfAnIntermediateValueIsFoundWhereItHappens) {
  Func square("square"), root("root"), f("f");
  Buffer<float> before = a.copy();
  square(x) = image(x) * image(x) + 1.0f;
  root(x) = sqrt(square(x));
  f(x) = root(x) * 0.5f;
  StabilityReport report = check_stability(f, {16}, {.extremes = {Extreme::Huge}});
  ASSERT_EQ(report.cases.size(), 2u);
  EXPECT_FALSE(report.cases[0].first_lost) << report.to_json();
  ASSERT_TRUE(report.cases[1].first_lost) << report.to_json();
  const StabilityReport::Place& place = *report.cases[1].first_lost;
  EXPECT_EQ(place.func, square.name());
  EXPECT_FALSE(place.is_adjoint);
  ASSERT_EQ(place.at.size(), 1u);
  EXPECT_EQ(place.own, INFINITY);
  EXPECT_GT(place.in_double, 1e75);
  expect_mentions(place.operation, {"*"});
  EXPECT_EQ(place.operation.find("+"), std::string::npos) << "the sum comes later";
  EXPECT_EQ(a(place.at[0]), before(place.at[0])) << "inputs are restored";
  EXPECT_GT(result(report.cases[1], square.name(), false).lost, 0);
}

// The report on an update names the iteration, or says that the accumulated value itself left the range. Terms that a
// predicate excludes do not count.
TEST_F(CheckStability, TheIterationOfAnUpdateIsNamed) {
  Func sums("sums"), product("product"), odd("odd");
  RDom r(0, 3), all(0, 16);
  sums(x) = 0.0f;
  sums(x) += image(x + r) * image(x + r);
  a(5) = 1e30f;
  auto lost = [&](const Func& f, const std::vector<int>& sizes) {
    StabilityReport report = check_stability(f, sizes, {.extremes = {}});
    return report.cases[0].first_lost ? report.cases[0].first_lost->operation : "nothing";
  };
  EXPECT_NE(lost(sums, {8}).find("*"), std::string::npos) << "the first element that meets it";
  expect_mentions(lost(sums, {8}), {", in update 0 at ", " = 2"});
  product() = 1e20f;
  product() *= image(all);
  EXPECT_EQ(lost(product, {}), "what its updates make of finite values");
  RDom even(0, 16);
  even.where(even % 2 == 0);
  odd() = 0.0f;
  odd() += image(even) * image(even);
  EXPECT_EQ(lost(odd, {}), "nothing") << "the predicate leaves it out";
}

TEST_F(CheckStability, CancellationShowsAsErrorAndAsCondition) {
  Func large("large"), f("f"), fine("fine");
  large(x) = image(x) * 0.7f + 4096.0f;
  f(x) = large(x) - 4096.0f;                 // loses 12 bits: ill done, though well posed
  fine(x) = sin(image(x) * 1000.0f) + f(x);  // ill posed
  StabilityReport report = check_stability(fine, {16}, {.extremes = {}});
  const auto& c = report.cases[0];
  EXPECT_LT(result(c, large.name(), false).worst_error, 1e-6);
  EXPECT_GT(result(c, f.name(), false).worst_error, 1e-5) << report.to_json();
  EXPECT_LT(result(c, f.name(), false).condition, 3) << report.to_json();
  EXPECT_GT(result(c, fine.name(), false).condition, 100) << report.to_json();
}

TEST_F(CheckStability, AGuardedPipelineStaysFiniteAndInputsAreRestored) {
  Func inverse("inverse"), f("f");
  inverse(x) = 1.0f / image(x);
  f(x) = select(abs(image(x)) > 0.125f && abs(image(x)) < 16.0f, inverse(x) * inverse(x), 0.0f);
  Buffer<float> before = a.copy();
  StabilityReport report = check_stability(f, {16});
  EXPECT_EQ(report.cases.size(), 7u);
  for (const auto& c : report.cases) {
    EXPECT_EQ(result(c, f.name(), false).non_finite, 0) << c.name;
    EXPECT_EQ(result(c, "image", true).non_finite, 0) << c.name << report.to_json();
    EXPECT_LT(result(c, "image", true).worst_error, 1e-5) << c.name;
  }
  ASSERT_TRUE(report.cases[1].first_non_finite);
  EXPECT_EQ(report.cases[1].first_non_finite->func, inverse.name()) << "1 / 0, in double too";
  for (int i = 0; i < 16; ++i) EXPECT_EQ(a(i), before(i));
}

TEST_F(CheckStability, TheReportIsJson) {
  Func f("f");
  f(x) = image(x) * 2.0f;
  auto json = nlohmann::json::parse(check_stability(f, {16}).to_json())["cases"];
  ASSERT_EQ(json.size(), 7u);
  EXPECT_EQ(json[6]["inputs"], "NaNs");
  EXPECT_TRUE(json[0]["first_non_finite"].is_null());
  EXPECT_EQ(json[6]["first_non_finite"]["own"], "nan");
  expect_mentions(json[6]["first_non_finite"]["operation"].dump(), {"an input"});
}

TEST_F(CheckStability, RandomRoundingTellsALosingPipelineFromAnIllPosedOne) {
  Func large("large"), small("small"), f("f");
  large(x) = image(x) * 0.7f + 4096.0f;
  small(x) = large(x) - 4096.0f;
  f(x) = small(x) * 2.0f;
  StabilityReport report = check_stability(f, {16}, {.extremes = {}});
  const auto& c = report.cases[0];
  EXPECT_LT(result(c, large.name(), false).rounding, 2) << report.to_json();
  EXPECT_GT(result(c, f.name(), false).rounding, 500) << report.to_json();
  EXPECT_LT(result(c, f.name(), false).condition, 3) << report.to_json();
}

TEST_F(CheckStability, RoundingInsideOfReductionsAndScansIsSeen) {
  Func sums("sums"), f("f");
  RDom r(0, 16), t(1, 15);
  Func scan("scan");
  scan(x) = image(x);
  scan(t) = scan(t) + scan(t - 1);  // sums up to 20
  sums() += scan(r);
  f() = sums() - 100.0f;
  StabilityReport report = check_stability(f, {}, {.extremes = {}});
  const auto& c = report.cases[0];
  EXPECT_GT(result(c, scan.name(), false).rounding, 0.1) << report.to_json();
  EXPECT_GT(result(c, sums.name(), false).rounding, 0.1) << report.to_json();
}

TEST_F(CheckStability, DeclaredRangesAreDrawnFromAndTheirEndsTried) {
  Func root("root"), f("f");
  Param<float> shift("shift");
  shift.set(0);
  root(x) = sqrt(image(x) - shift);
  f(x) = root(x);
  auto cases = [&](double low, double high) {
    return check_stability(f, {16}, {.extremes = {}, .ranges = {{image, low, high}}}).cases;
  };
  const auto fine = cases(1, 1e6);
  ASSERT_EQ(fine.size(), 3u);
  EXPECT_EQ(fine[1].name, "in the ranges");
  EXPECT_EQ(fine[2].name, "at the ends of the ranges");
  for (const auto& c : fine) EXPECT_FALSE(c.first_non_finite) << c.name;
  EXPECT_GT(result(fine[1], root.name(), false).condition, 0.1);
  const auto broken = cases(-1, 1);
  EXPECT_FALSE(broken[0].first_non_finite) << "as bound";
  ASSERT_TRUE(broken[1].first_non_finite);
  EXPECT_EQ(broken[1].first_non_finite->func, root.name());
  EXPECT_GT(result(broken[2], root.name(), false).non_finite, 0);
  const auto pole = cases(0, 0)[2];
  ASSERT_TRUE(pole.first_non_finite) << "the adjoint of sqrt at 0";
  EXPECT_TRUE(pole.first_non_finite->is_adjoint);
}

TEST_F(CheckStability, OutputsMayBeginAnywhere) {
  Func f("f");
  f(x) = image(x + 5) * 2.0f;
  StabilityReport report = check_stability(f, {16}, {.extremes = {Extreme::NaNs}, .mins = {-5}});
  ASSERT_TRUE(report.cases[1].first_non_finite) << report.to_json();
  EXPECT_LT(report.cases[1].first_non_finite->at[0], 11);
  EXPECT_GE(report.cases[1].first_non_finite->at[0], -5);
}

// The extremes are those of the input's type: 60000 is finite in float16, but twice as much is not.
TEST_F(CheckStability, NarrowFloatsGoToTheirOwnEnds) {
  ImageParam narrow(Float(16), 1, "narrow");
  Func values("values"), f("f");
  values(x) = cast(Float(16), cast<float>(x) * 0.25f + 0.5f);
  narrow.set(values.realize({8}));
  f(x) = narrow(x) * cast(Float(16), 8.0f);
  StabilityReport report = check_stability(f, {8}, {.extremes = {Extreme::Tiny, Extreme::Huge}});
  ASSERT_EQ(report.cases.size(), 3u);
  EXPECT_EQ(report.cases[0].funcs.at(0).lost, 0);
  EXPECT_EQ(report.cases[1].funcs.at(0).lost, 0);
  EXPECT_GT(report.cases[2].funcs.at(0).lost, 0) << "an eighth of the range, times 8";
  EXPECT_EQ(report.cases[2].funcs.at(1).non_finite, 0) << "its derivative is 8";
}

TEST_F(CheckStability, TuplesAreLookedAtValueByValue) {
  Func pair("pair"), f("f");
  pair(x) = Tuple(image(x) * 2.0f, cast<int>(image(x)), image(x) * 0.7f + 4096.0f);
  f(x) = pair(x)[0] + cast<float>(pair(x)[1]) + (pair(x)[2] - 4096.0f);
  StabilityReport report = check_stability(f, {16}, {.extremes = {}});
  std::vector<int> values;
  for (const auto& r : report.cases[0].funcs) {
    if (r.name == pair.name() && !r.is_adjoint) values.push_back(r.value);
  }
  EXPECT_EQ(values, (std::vector<int>{0, 2}));
  EXPECT_TRUE(report.left_out.empty()) << report.to_json();
}

TEST_F(CheckStability, WhatIsLeftOutIsListedWithTheReason) {
  Func wave("wave"), index("index"), f("f");
  Var i("i");
  wave(i) = sin(cast<float>(i));
  index(x) = cast<int>(image(x) * 100.0f);
  f(x) = wave(index(x)) * image(x);
  StabilityReport report = check_stability(f, {16}, {.extremes = {}});
  std::map<std::string, std::string> reasons;
  for (const auto& l : report.left_out) reasons[l.name] = l.reason;
  expect_mentions(reasons[index.name()], {"none of its values"});
  EXPECT_NE(reasons[wave.name()].find("region"), std::string::npos) << report.to_json();
}

TEST_F(CheckStability, UnboundInputsAndWrongSizesAreErrors) {
  Func f("f"), g("g");
  ImageParam unbound(Float(32), 1, "unbound_too");
  f(x) = unbound(x);
  g(x) = image(x);
  expect_error<RuntimeError>({"\"unbound_too\""}, [&] { check_stability(f, {4}); });
  expect_error({"2 sizes"}, [&] { check_stability(g, {4, 4}); });
  auto with_range = [&](const InputRange& range) {
    return error_of([&] { check_stability(g, {4}, {.ranges = {range}}); });
  };
  expect_mentions(with_range({image, 2, 1}), {"from 2 to 1", "the lower first"});
  expect_mentions(with_range({image, 0, INFINITY}), {"finite"});
  expect_mentions(with_range({unbound, 0, 1}), {"something else", "Param"});
}

}  // namespace
}  // namespace retrograde::gradient

// check_stability finds what was built to be unstable, names the Func, and leaves stable pipelines
// alone.
#include <nlohmann/json.hpp>

#include "checks/check_stability.h"
#include "frontend/image_param.h"
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
  square(x) = image(x) * image(x) + 1.0f;
  root(x) = sqrt(square(x));
  f(x) = root(x) * 0.5f;
  StabilityReport report = check_stability(f, {16}, {.extremes = {Extreme::Huge}});
  ASSERT_EQ(report.cases.size(), 2u);
  EXPECT_EQ(report.cases[0].first_lost, "") << report.to_json();
  EXPECT_EQ(report.cases[1].first_lost, square.name()) << report.to_json();
  EXPECT_GT(result(report.cases[1], square.name(), false).lost, 0);
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
  EXPECT_EQ(report.cases[1].first_non_finite, inverse.name()) << "1 / 0, in double too";
  for (int i = 0; i < 16; ++i) EXPECT_EQ(a(i), before(i));
}

TEST_F(CheckStability, TheReportIsJson) {
  Func f("f");
  f(x) = image(x) * 2.0f;
  auto json = nlohmann::json::parse(check_stability(f, {4}).to_json());
  EXPECT_EQ(json.size(), 7u);
  EXPECT_EQ(json[6]["inputs"], "NaNs");
}

TEST_F(CheckStability, UnboundInputsAndWrongSizesAreErrors) {
  Func f("f"), g("g");
  ImageParam unbound(Float(32), 1, "unbound_too");
  f(x) = unbound(x);
  g(x) = image(x);
  expect_mentions(error_of<RuntimeError>([&] { check_stability(f, {4}); }), {"\"unbound_too\""});
  expect_mentions(error_of<CompileError>([&] { check_stability(g, {4, 4}); }), {"2 sizes"});
}

}  // namespace
}  // namespace retrograde::gradient

// Tests the budget for overwritten values that partials need. In programs as users write them, the gradients are right
// under the defaults, explain() lists the values that are kept, and updates beyond the budget are refused.
#include "autodiff/updates/version_budget.h"

#include "frontend/data/param.h"
#include "gradient/gradient_check.h"
#include "support/errors.h"
#include "support/facts.h"

namespace retrograde::gradient {
namespace {

struct VersionBudget : ::testing::Test {
  Var x{"x"}, y{"y"};
  Func f{"f"};
  static Buffer<float> positive(const std::vector<int>& sizes) {
    return random_image(sizes, 0.5, 1.5, 3);
  }
  // Values that are well separated, because a maximum has no derivative at ties.
  static Buffer<float> separated(int n) {
    Buffer<float> values(n);
    for (int i = 0; i < n; ++i) values(i) = 0.5f + static_cast<float>(i * 7 % n) / 16.0f;
    return values;
  }
};

TEST_F(VersionBudget, Products) {
  Buffer<float> a = positive({9});
  RDom r(0, 4);
  f(x) = 1.0f;
  f(x) *= a(x + r);
  expect_gradient(weighted_sum(f, {6}), a);
}

TEST_F(VersionBudget, InlineProducts) {
  Buffer<float> a = positive({5, 4});
  RDom r(0, 4);
  f(x) = product(a(x, r));
  expect_gradient(weighted_sum(f, {5}), a);
}

TEST_F(VersionBudget, RecursiveFiltersInPlaceWithGatesOfTheData) {
  Buffer<float> a = positive({7, 3});
  RDom r(1, 6);
  f(x, y) = a(x, y);
  f(r, y) = f(r, y) * (1.0f - 0.5f * a(r, y)) + 0.5f * a(r, y) * f(r - 1, y);
  f(6 - r, y) = f(6 - r, y) + 0.25f * f(7 - r, y) * f(6 - r, y);
  expect_gradient(weighted_sum(f, {7, 3}), a);
}

TEST_F(VersionBudget, MaximaOfWindowsInLogSteps) {
  Buffer<float> a = separated(16);
  RDom r(0, 8, 0, 3);
  f(x, y) = 0.0f;
  f(x, 0) = a(x);
  f(r.x, r.y + 1) = max(f(r.x, r.y), f(r.x + (1 << r.y), r.y));
  Func g("g");
  g(x) = f(x, 3) * f(x, 3);
  expect_gradient(weighted_sum(g, {8}), a);
}

TEST_F(VersionBudget, MaximaInLogStepsInOneRow) {
  Buffer<float> a = separated(12);
  f(x) = a(clamp(x, 0, 11));
  for (int step : {1, 2, 4}) {
    RDom r(0, 8);
    f(r) = max(f(r), f(r + step)) * (1.0f + 0.1f * f(r));
  }
  expect_gradient(weighted_sum(f, {5}), a);
}

// Logistic growth: each value is multiplied by the previous one.
TEST_F(VersionBudget, CompoundScans) {
  Buffer<float> a = positive({8});
  RDom r(1, 7);
  f(x) = a(x);
  f(r) = f(r) * f(r - 1) + f(r - 1) * (2.0f - f(r - 1));
  expect_gradient(weighted_sum(f, {8}), a);
}

TEST_F(VersionBudget, ComplexProductsInTuples) {
  Buffer<float> a = positive({5, 2});
  RDom r(0, 5);
  f() = Tuple(1.0f, 0.0f);
  f() = Tuple(f()[0] * a(r, 0) - f()[1] * a(r, 1), f()[0] * a(r, 1) + f()[1] * a(r, 0));
  Func loss("loss");
  loss() = f()[0] * 2.0f + f()[1] * f()[1];
  expect_gradient(loss, a);
}

TEST_F(VersionBudget, ExplainSaysWhatIsKept) {
  Buffer<float> a = positive({9});
  RDom r(0, 4);
  f(x) = 1.0f;
  f(x) *= a(x + r);
  expect_fact(propagate_adjoints(weighted_sum(f, {6})).explanations(), Fact::Version, f.name(),
              "\"f_steps\" keeps versions within the budget of 268435456 bytes "
              "(AdjointOptions::version_bytes): 120 bytes, all together 120");
}

std::string error_of(const Func& loss, const AdjointOptions& options) {
  return retrograde::error_of<UserError>([&] { propagate_adjoints(loss, options); });
}

TEST_F(VersionBudget, WhatDoesNotFitIsRefused) {
  Buffer<float> a = positive({9});
  RDom r(0, 4);
  f(x) = 1.0f;
  f(x) *= a(x + r);
  const Func loss = weighted_sum(f, {6});
  EXPECT_EQ(error_of(loss, {.version_bytes = 120}), "no error");
  const std::string words = error_of(loss, {.version_bytes = 119});
  expect_mentions(words, {"differentiate the update \"f", "fit 119 bytes", "they are 120 bytes",
                          "raise AdjointOptions::version_bytes"});
  EXPECT_EQ(error_of(loss, {.overwritten = Overwritten::Store, .version_bytes = 119}), "no error");
}

TEST_F(VersionBudget, WhatAllUpdatesKeepCountsTogether) {
  Buffer<float> a = positive({9});
  Func g("g");
  for (Func h : {f, g}) {
    RDom r(0, 4);
    h(x) = 1.0f;
    h(x) *= a(x + r);
  }
  Func both("both");
  both(x) = f(x) + g(x);
  const Func loss = weighted_sum(both, {6});
  EXPECT_EQ(error_of(loss, {.version_bytes = 240}), "no error");
  expect_mentions(error_of(loss, {.version_bytes = 239}), {"they are 240 bytes"});
}

// The call decides whether values are kept, because only then are the sizes known.
TEST_F(VersionBudget, SizesKnownAtRunTimeOnlyAreCheckedByTheCall) {
  ImageParam a(Float(32), 2, "a");
  Param<int> columns("columns");
  RDom r(0, a.height());
  f(x) = 1.0f;
  f(x) *= a(x, r);
  RDom q(0, columns);
  Func loss("loss");
  loss() = 0.0f;
  loss() += f(q) * cast<float>(q + 1);
  Derivative d = propagate_adjoints(loss, {.version_bytes = 4 * 3 * 5});
  expect_fact(
      d.explanations(), Fact::Version, f.name(),
      "\"f_steps\" keeps versions within the budget of 60 bytes "
      "(AdjointOptions::version_bytes): its size is known at run time only, when a call that "
      "needs more fails");
  Func gradient = d(a);

  Buffer<float> small = positive({3, 4}), large = positive({3, 5});
  a.set(small);
  columns.set(3);
  Buffer<float> found = gradient.realize({3, 4});
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j) {
      float expected = static_cast<float>(i + 1);
      for (int k = 0; k < 4; ++k) expected *= k == j ? 1.0f : small(i, k);
      EXPECT_NEAR(found(i, j), expected, 1e-5);
    }
  }
  a.set(large);
  expect_error<RuntimeError>(
      {"the update \"f", "fit 60 bytes", "they are 72 bytes", "version_bytes"}, [&] {
        gradient.realize({3, 5});
      });
}

}  // namespace
}  // namespace retrograde::gradient

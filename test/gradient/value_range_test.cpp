// Tests ValueRanges: the analysis of which values may be infinite, and which bounds prove that they are not.
#include "autodiff/rules/value_range.h"

#include <cmath>

#include "gradient/gradient_check.h"

namespace retrograde::gradient {
namespace {

using autodiff::ValueRange;

class ValueRanges : public ::testing::Test {
 protected:
  Var x{"x"};
  Buffer<float> a = Buffer<float>(8);
  Buffer<uint8_t> bytes = Buffer<uint8_t>(8);

  static ValueRange range_of(const Func& f) {
    const autodiff::ValueRanges ranges(graph::topological_order({f.function()}));
    return ranges.of(f(std::vector<Expr>(static_cast<size_t>(f.dimensions()), Expr(0))));
  }
  // The range of an expression that is read through another Func.
  ValueRange range_of(const Expr& e) const {
    Func inner("inner"), f("f");
    inner(x) = e;
    f(x) = inner(x) + 0.0f;
    return range_of(f);
  }
  bool may_be_infinite(const Expr& e) const { return range_of(e).infinite; }
};

TEST_F(ValueRanges, WhatMemoryHoldsCountsAsFiniteAndSoDoSumsAndProducts) {
  EXPECT_FALSE(may_be_infinite(a(x)));
  EXPECT_FALSE(may_be_infinite(a(x) * a(x) - 3.0f * a(x)));
  EXPECT_FALSE(may_be_infinite(pow(a(x), 3) + sqrt(abs(a(x))) + tanh(a(x))));
  EXPECT_FALSE(may_be_infinite(cast<float>(bytes(x)) / 255.0f));
}

TEST_F(ValueRanges, PolesAndOverflowAreInfinite) {
  EXPECT_TRUE(may_be_infinite(1.0f / a(x)));
  EXPECT_TRUE(may_be_infinite(log(a(x))));
  EXPECT_TRUE(may_be_infinite(exp(a(x))));
  EXPECT_TRUE(may_be_infinite(pow(a(x), -1.0f)));
  EXPECT_TRUE(may_be_infinite(select(a(x) > 0, -INFINITY, a(x))));
  EXPECT_TRUE(may_be_infinite(1.0f / abs(a(x)))) << "0 is not excluded";
  EXPECT_TRUE(may_be_infinite(min(1.0f / a(x), 1.0f))) << "-inf is smaller";
}

TEST_F(ValueRanges, BoundsProveThatValuesAreFinite) {
  EXPECT_FALSE(may_be_infinite(1.0f / (1.0f + exp(-a(x)))));
  EXPECT_FALSE(may_be_infinite(exp(-a(x) * a(x)))) << "not above 1";
  EXPECT_FALSE(may_be_infinite(exp(-0.5f * a(x) * a(x)))) << "a Gaussian";
  EXPECT_FALSE(may_be_infinite(exp(a(x) * (a(x) * -0.5f))));
  EXPECT_TRUE(may_be_infinite(exp(0.5f * a(x) * a(x))));
  EXPECT_FALSE(may_be_infinite(exp(min(a(x), 80.0f))));
  EXPECT_FALSE(may_be_infinite(clamp(1.0f / a(x), 0.0f, 1.0f)));
  EXPECT_FALSE(may_be_infinite(a(x) / max(sqrt(a(x) * a(x)), 1e-12f)));
  EXPECT_FALSE(may_be_infinite(log(1.0f + abs(a(x)))));
  EXPECT_FALSE(may_be_infinite(1.0f / (cast<float>(bytes(x)) + 0.5f)));
  const ValueRange logistic = range_of(1.0f / (1.0f + exp(-a(x))));
  EXPECT_EQ(logistic.min, 0);
  EXPECT_EQ(logistic.max, 1);
}

TEST_F(ValueRanges, UpdatesJoinWhatTheyWrite) {
  RDom r(0, 8);
  Func total("total"), largest("largest"), decaying("decaying"), growing("growing");
  total(x) = 1.0f;
  total(x) += a(r) * a(r);
  EXPECT_EQ(range_of(total).min, 1);
  EXPECT_FALSE(range_of(total).infinite);
  largest() = -INFINITY;
  largest() = max(largest(), a(r));
  EXPECT_TRUE(range_of(largest).infinite) << "over an empty domain";
  decaying(x) = 0.5f;
  decaying(r) = decaying(r) * 0.5f;
  EXPECT_EQ(range_of(decaying).min, 0);
  EXPECT_EQ(range_of(decaying).max, 0.5);
  growing(x) = 2.0f;
  growing(r) = 1.0f / growing(r);
  EXPECT_TRUE(range_of(growing).infinite) << "0.5, 2, ...: bounds only leap to 0";
}

}  // namespace
}  // namespace retrograde::gradient

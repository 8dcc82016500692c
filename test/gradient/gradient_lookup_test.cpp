// Tests how a Derivative finds gradients: each request returns a gradient, zeros with a reason, or an error.
#include <gtest/gtest.h>

#include "frontend/language/extern_function.h"
#include "gradient/gradient_check.h"
#include "support/errors.h"
#include "support/facts.h"
#include "support/variables.h"

namespace retrograde {
namespace {

Buffer<float> ramp(int n) {
  Buffer<float> values(n);
  for (int i = 0; i < n; i++) values(i) = 1.0f + 0.5f * i;
  return values;
}

// sum over [0, 4) of im(x)^2
struct Squares {
  ImageParam im{Float(32), 1};
  Func f{"f"}, loss{"loss"};
  RDom r{0, 4};
  Squares() {
    im.set(ramp(4));
    f(x) = im(x) * im(x);
    loss() = 0.0f;
    loss() += f(r);
  }
};

void expect_values(const Func& gradient, const std::vector<float>& expected) {
  const Buffer<float> found = Func(gradient).realize({static_cast<int>(expected.size())});
  for (size_t i = 0; i < expected.size(); i++)
    EXPECT_EQ(found(static_cast<int>(i)), expected[i]) << i;
}

TEST(GradientLookup, FuncsThatReadAnImageStandForIt) {
  Squares s;
  const Derivative d = propagate_adjoints(s.loss);
  expect_values(d(Func(s.im)), {2, 3, 4, 5});
  Func reads;
  reads(x) = s.im(x);
  expect_values(d(reads), {2, 3, 4, 5});
  Buffer<float> b = ramp(4);
  Func f, loss;
  f(x) = b(x) * b(x);
  loss() = 0.0f;
  loss() += f(s.r);
  expect_values(propagate_adjoints(loss)(Func(b)), {2, 3, 4, 5});
}

TEST(GradientLookup, FuncsThatReadAnImageDifferentlyAreTheirOwn) {
  Squares s;
  Func shifted, g, loss;
  shifted(x) = s.im(x);
  shifted.compute_root();
  g(x) = shifted(x) * s.im(x);
  loss() = 0.0f;
  loss() += g(s.r);
  const Derivative d = propagate_adjoints(loss);
  expect_values(d(shifted), {1.0f, 1.5f, 2.0f, 2.5f});
  expect_values(d(s.im), {2, 3, 4, 5});
}

TEST(GradientLookup, IntegersAndWhatIsNotReadAreZerosWithAReason) {
  Squares s;
  Param<float> unread("unread");
  Param<int> count("count");
  ImageParam other(Float(32), 2, "other"), bytes(UInt(8), 1, "bytes");
  Buffer<uint8_t> ones(4);
  ones.fill(1);
  bytes.set(ones);
  count.set(3);
  Func index("index"), g("g"), loss("sum"), stranger("stranger");
  index(x) = x;
  stranger(x) = cast<float>(x);
  g(x) = s.im(x) * count * bytes(x) + index(x);
  loss() = 0.0f;
  loss() += g(s.r);
  const Derivative d = propagate_adjoints(loss);
  expect_values(d(s.im), {3, 3, 3, 3});
  EXPECT_EQ(Buffer<float>(d(unread).realize())(), 0.0f);
  EXPECT_EQ(Buffer<float>(d(count).realize())(), 0.0f);
  EXPECT_EQ(Buffer<float>(d(other).realize({2, 2}))(1, 1), 0.0f);
  expect_values(d(bytes), {0, 0, 0, 0});
  expect_values(d(index), {0, 0, 0, 0});
  expect_values(d(stranger), {0, 0, 0, 0});
  for (const std::string& name : {unread.name(), other.name(), stranger.name()})
    expect_fact(d.explanations(), Fact::Zero, name, "the output does not depend on it");
  expect_fact(d.explanations(), Fact::Zero, count.name(),
              "its type is int32: integers have no derivative");
  expect_fact(d.explanations(), Fact::Zero, bytes.name(),
              "its type is uint8: integers have no derivative");
  EXPECT_TRUE(d(stranger).same_as(d(stranger))) << "a schedule of it must not be lost";
  EXPECT_FALSE(d.has(stranger));
  EXPECT_TRUE(d.has(s.im));
}

// rule: a gradient is looked up that was built, or is zero
TEST(GradientLookup, WhatWasNotBuiltIsAnError) {
  Squares s;
  ImageParam weights(Float(32), 1, "weights");
  Func g("g"), loss("sum");
  g(x) = s.f(x) * weights(x);
  loss() = 0.0f;
  loss() += g(s.r);
  const Derivative d = propagate_adjoints(loss, {.wrt = {weights}});
  expect_error({"the gradient by", "no requested gradient needs its adjoint", "wrt"},
               [&] { d(s.im); });
  expect_error({"undefined", "it has none"}, [&] { d(Func("undefined")); });
}

TEST(GradientLookup, OutputsWithDimensionsNeedAnAdjoint) {
  Squares s;
  expect_error({"that of a scalar", "1 dimensions", "loss() += f(r.x, r.y)"},
               [&] { propagate_adjoints(s.f); });
}

// No other object holds the parameter of a Buffer that no Func reads, so its address may be reused.
TEST(GradientLookup, BuffersThatNothingReadsAreNotTakenForEachOther) {
  Squares s;
  const Derivative d = propagate_adjoints(s.loss);
  for (size_t i = 0; i < 20; ++i) {
    const Buffer<float> unread(std::vector<int>(1 + i % 3, 2));
    EXPECT_EQ(d(unread).dimensions(), unread.dimensions());
  }
}

// A Param whose gradient is not requested is the argument of a C function, which has no known derivative.
TEST(GradientLookup, AParamThatNobodyAskedForDoesNotStandInTheWay) {
  Squares s;
  Param<float> volume("volume");
  volume.set(8.0f);
  Func g("g"), loss("sum");
  g(x) = s.im(x) * call_pure_c_function<float, float>("cbrtf", volume);
  loss() = 0.0f;
  loss() += g(s.r);
  const Derivative d = propagate_adjoints(loss);
  expect_values(d(s.im), {2, 2, 2, 2});
  expect_error({"volume", "left out"}, [&] { d(volume); });
  EXPECT_THROW(propagate_adjoints(loss, {.wrt = {volume}}), Error);
}

}  // namespace
}  // namespace retrograde

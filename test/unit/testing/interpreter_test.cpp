// The interpreter itself: order of evaluation, demand, error bounds. Expected values are computed
// by hand or by plain loops.
#include "testing/interpreter.h"
#include "support/errors.h"

#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cmath>

namespace {

using namespace retrograde;
using oracle::Array;
using oracle::Interpreter;
using oracle::InterpreterOptions;
using oracle::Rounding;
using oracle::Value;

const Var x("x"), y("y");

std::vector<int64_t> ints(const Func& f, int extent) {
  const Array array = Interpreter().realize(f.function(), {{0}, {extent}})[0];
  std::vector<int64_t> result;
  for (const Value& value : array.values) result.push_back(value.scalar.i);
  return result;
}

Value value_at(const Func& f, int at, Rounding rounding, bool widen = false) {
  Interpreter interpreter(InterpreterOptions{.widen = widen, .rounding = rounding});
  return interpreter.realize(f.function(), {{at}, {1}})[0].values[0];
}

TEST(Interpreter, FirstReductionVariableRunsFastest) {
  Func f;
  RDom r(0, 2, 0, 3);
  f(x) = 0;
  f(0) = f(0) * 10 + r.x + 2 * r.y;
  EXPECT_EQ(ints(f, 1), (std::vector<int64_t>{12345}));
}

TEST(Interpreter, UpdatesRunInOrderOverWhatTheirPredecessorsStored) {
  Func f;
  RDom r(1, 4);
  f(x) = x;
  f(r) = f(r) + f(r - 1);
  f(x) = f(x) * 2;
  f(3) = -1;
  EXPECT_EQ(ints(f, 6), (std::vector<int64_t>{0, 2, 6, -1, 20, 10}));
}

TEST(Interpreter, AllLoadsOfAPointHappenBeforeItsStores) {
  Func f, g;
  f(x) = Tuple(x, 100 + x);
  f(x) = Tuple(f(x)[1], f(x)[0]);
  g(x) = f(x)[0] * 1000 + f(x)[1];
  EXPECT_EQ(ints(g, 2), (std::vector<int64_t>{100000, 101001}));
}

TEST(Interpreter, PredicateSelectsPointsOfTheDomain) {
  Func f;
  RDom r(0, 6);
  r.where(r % 3 == 1);
  f(x) = 0;
  f(r) += 5;
  EXPECT_EQ(ints(f, 6), (std::vector<int64_t>{0, 5, 0, 0, 5, 0}));
}

TEST(Interpreter, UndefStoresNothing) {
  Func f;
  RDom r(0, 4);
  f(x) = 7;
  f(r) = select(r == 2, 9, undef<int32_t>());
  EXPECT_EQ(ints(f, 4), (std::vector<int64_t>{7, 7, 9, 7}));
}

TEST(Interpreter, ArmNotChosenIsNotEvaluated) {
  Buffer<int32_t> in(2);
  in.fill(3);
  Func f;
  f(x) = select(x < 2, in(x), -1);
  EXPECT_EQ(ints(f, 4), (std::vector<int64_t>{3, 3, -1, -1}));
}

TEST(Interpreter, ReadOutsideOfAnImageNamesThePlace) {
  Buffer<int32_t> in(2);
  in.fill(0);
  Func f;
  f(x) = in(x + 1);
  expect_error<UserError>({"(2)"}, [&] { ints(f, 2); });
}

TEST(Interpreter, TouchesExactlyWhatIsNeeded) {
  ImageParam in(Int(32), 1);
  Buffer<int32_t> buffer(100);
  buffer.fill(1);
  in.set(buffer);
  Func f, h;
  RDom r(0, 3);
  h(x) = in(2 * x);
  f(x) = 0;
  f(x) += h(x + r);
  Interpreter interpreter;
  interpreter.realize(f.function(), {{5}, {2}});
  const oracle::Region touched = interpreter.touched(*in.parameter());
  EXPECT_EQ(touched.mins, std::vector<int>{10});
  EXPECT_EQ(touched.extents, std::vector<int>{7});  // 10, 12, 14, 16
}

TEST(Interpreter, FailedRequireIsAnError) {
  Func f;
  f(x) = require(x < 2, x, "too far");
  EXPECT_NO_THROW(ints(f, 2));
  EXPECT_THROW(ints(f, 3), UserError);
}

TEST(Interpreter, OperationsOfARunAreBounded) {
  Func f;
  f(x) = x * x + 1;
  Interpreter enough(InterpreterOptions{.max_operations = 20}),
      too_few(InterpreterOptions{.max_operations = 19});
  EXPECT_NO_THROW(enough.realize(f.function(), {{0}, {10}}));
  EXPECT_THROW(too_few.realize(f.function(), {{0}, {11}}), UserError);
}

TEST(Interpreter, WideningComputesInDouble) {
  Func f;
  f(x) = cast<float>(x + 1) / 3.0f;
  EXPECT_EQ(value_at(f, 0, Rounding::Strict).scalar.f, static_cast<double>(1.0f / 3.0f));
  EXPECT_EQ(value_at(f, 0, Rounding::Strict, true).scalar.f, 1.0 / 3.0);
}

TEST(Interpreter, LongChainOfFuncsIsNoProblem) {
  std::vector<Func> chain(5000);
  chain[0](x) = x;
  for (size_t i = 1; i < chain.size(); ++i) chain[i](x) = chain[i - 1](x) + 1;
  EXPECT_EQ(ints(chain.back(), 1), (std::vector<int64_t>{4999}));
}

TEST(TrackedValue, ExactArithmeticHasNoError) {
  Func f;
  f(x) = cast<float>(x) * 0.5f + 3.0f;
  EXPECT_EQ(value_at(f, 5, Rounding::Contraction).error, 0);
  EXPECT_GT(value_at(f, 5, Rounding::Reordering).error, 0) << "another order may not be exact";
}

TEST(TrackedValue, BoundCoversContraction) {
  const float a = 1.1f, b = 3.3f, c = -3.63f;
  Func f;
  f(x) = cast<float>(x) * 0.0f + Expr(a) * (Expr(b) + cast<float>(x)) + Expr(c);
  const Value value = value_at(f, 0, Rounding::Contraction);
  const float contracted = std::fma(a, b, c);
  EXPECT_NE(contracted, static_cast<float>(value.scalar.f)) << "the case is too easy";
  EXPECT_LE(std::fabs(contracted - value.scalar.f), value.error);
  EXPECT_LT(value.error, 1e-6);
}

TEST(TrackedValue, BoundCoversContractionIntoAnOperator) {
  Func product, f;
  product(x) = cast<float>(x) * 1.1f;
  f(x) = absd(product(x), 0.25f);
  const Value value = value_at(f, 3, Rounding::Contraction);
  const float contracted = std::fabs(std::fma(3.0f, 1.1f, -0.25f));
  EXPECT_GT(value.error, 0);
  EXPECT_LE(std::fabs(contracted - value.scalar.f), value.error);
}

// LLVM computes the product in float32, where it has the same value, and fuses it with the sum.
TEST(TrackedValue, BoundCoversContractionAcrossANarrowingCast) {
  const float a = 1.1f, b = 3.3f, c = -3.63f;
  Func f;
  f(x) = cast<float>(cast<double>(cast<float>(x) + Expr(a)) * cast<double>(Expr(b))) + Expr(c);
  const Value value = value_at(f, 0, Rounding::Contraction);
  const float contracted = std::fma(a, b, c);
  EXPECT_NE(contracted, static_cast<float>(value.scalar.f)) << "the case is too easy";
  EXPECT_LE(std::fabs(contracted - value.scalar.f), value.error);
  EXPECT_EQ(value_at(f, 0, Rounding::Strict).error, 0);
}

// The larger operand determines the bound, with either sign.
TEST(TrackedValue, BoundCoversTheRoundingOfALerpOfNegatives) {
  Func f("f");
  f(x) = lerp(Expr(-0.514f), select(x == 0, -0.01f, -0.02f), 0.25f);
  EXPECT_GE(value_at(f, 0, Rounding::Contraction).error, 0x1p-24);
}

TEST(TrackedValue, DecisionWithinTheErrorIsUnstable) {
  Func third, f;
  third(x) = cast<float>(x) * 0.1f;
  f(x) = select(third(x) * 3.0f + 0.0f * third(x) < 0.3f, 1, 2);
  EXPECT_FALSE(value_at(f, 1, Rounding::Contraction).is_stable());
  EXPECT_TRUE(value_at(f, 2, Rounding::Contraction).is_stable());
  EXPECT_TRUE(value_at(f, 1, Rounding::Strict).is_stable());
}

TEST(Comparison, FindsOneWrongElement) {
  Func f;
  f(x) = x * x;
  const Array expected = Interpreter().realize(f.function(), {{0}, {10}})[0];
  Buffer<int32_t> buffer(10);
  for (int i = 0; i < 10; ++i) buffer(i) = i * i;
  EXPECT_TRUE(oracle::compare(expected, *buffer.raw_buffer()).agrees());
  buffer(7) = 48;
  const oracle::Comparison comparison = oracle::compare(expected, *buffer.raw_buffer());
  EXPECT_EQ(comparison.mismatches, 1u);
  EXPECT_EQ(comparison.first_mismatch, "(7): 48 instead of 49 +- 0");
}

}  // namespace

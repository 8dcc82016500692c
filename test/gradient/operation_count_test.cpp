// Tests the counts of operations and bytes of small pipelines against counts by hand from their definitions.
#include "autodiff/report/operation_count.h"

#include <gtest/gtest.h>

#include "gradient/programs_suite.h"
#include "support/variables.h"

namespace retrograde::gradient {
namespace {

autodiff::OperationCount count(const Func& f, int extent) {
  return autodiff::count_operations({{f.function(), {{Expr(0), Expr(extent - 1)}}}});
}
double value(const autodiff::Count& c) { return c.value().value_or(-1); }

TEST(OperationCount, EachElementOfAStencilCountsItsWork) {
  Buffer<float> a = line(10);
  Func f("f");
  f(x) = (a(x) + a(x + 1)) * 0.5f + exp(a(x));  // a(x) is loaded once
  autodiff::OperationCount c = count(f, 8);
  EXPECT_EQ(value(c.moves()), 8 * 3);
  EXPECT_EQ(value(c.adds()), 8 * 2);
  EXPECT_EQ(value(c.mults()), 8 * 1);
  EXPECT_EQ(value(c.nonlinear()), 8 * 1);
  EXPECT_EQ(value(c.operations()), 8 * 7);
  EXPECT_EQ(value(c.bytes()), 8 * 4);
}

TEST(OperationCount, EqualSubexpressionsCountOnceWhateverTheirNodes) {
  Buffer<float> a = line(10);
  Func f("f");
  f(x) = (a(x) + 1.0f) * (a(x) + 1.0f);
  EXPECT_EQ(value(count(f, 4).adds()), 4);
}

TEST(OperationCount, AReductionRunsOverItsDomain) {
  Buffer<float> a = line(10);
  Func f("f");
  RDom r(0, 3);
  f(x) = 0.0f;
  f(x) += a(x + r) * a(r);
  autodiff::OperationCount c = count(f, 5);
  EXPECT_EQ(value(c.mults()), 5 * 3);
  EXPECT_EQ(value(c.adds()), 5 * 3);
  EXPECT_EQ(value(c.moves()), 5 + 5 * 3 * 4);  // store 0; load f, a, a, store f
}

TEST(OperationCount, WhatIsComputedAgainCountsAtEachRead) {
  Buffer<float> a = line(12);
  Func f("f"), g("g");
  f(x) = sqrt(a(x));
  g(x) = f(x) + f(x + 1);
  autodiff::OperationCount inlined = count(g, 6);
  EXPECT_EQ(value(inlined.nonlinear()), 12);
  EXPECT_EQ(value(inlined.find(f.function().get())->evaluations), 12);
  EXPECT_EQ(value(inlined.bytes()), 24);
  f.compute_root();
  autodiff::OperationCount stored = count(g, 6);
  EXPECT_EQ(value(stored.nonlinear()), 7);
  EXPECT_EQ(value(stored.bytes()), 24 + 28);
}

TEST(OperationCount, ALongChainOfInlinedFuncsCostsLinearTimeToCount) {
  Func last("f0");
  Buffer<float> a = line(300);
  last(x) = a(x);
  for (int i = 1; i < 200; ++i) {
    Func next("f" + std::to_string(i));
    next(x) = last(x) + last(x + 1);
    if (i < 199) next.compute_inline();
    last = next;
  }
  EXPECT_NEAR(value(count(last, 1).adds()), std::ldexp(1.0, 199) - 1, std::ldexp(1.0, 150));
}

TEST(OperationCount, ExtentsOfRunTimeStaySymbols) {
  ImageParam a(Float(32), 1, "a");
  Param<int> n("n");
  Func f("f");
  RDom r(0, n);
  f() = 0.0f;
  f() += a(r) * 2.0f;
  autodiff::OperationCount c = autodiff::count_operations({{f.function(), {}}});
  EXPECT_FALSE(c.mults().value());
  EXPECT_EQ(c.mults().text(), "n");
  EXPECT_EQ(c.moves().text(), "1 + 3*n");
}

TEST(OperationCount, TheGradientOfASquaredErrorCostsASmallMultiple) {
  Buffer<float> a = line(64), b = line(64, 5);
  Func f("f"), loss("loss");
  RDom r(0, 64);
  f(x) = a(x) * b(x);
  loss() = 0.0f;
  loss() += pow(f(r) - 1.0f, 2);
  Derivative d = propagate_adjoints(loss);
  GradientOperations operations = d.operations();
  ASSERT_TRUE(operations.ratio());
  EXPECT_GT(*operations.ratio(), 1);
  EXPECT_LT(*operations.ratio(), 5);
  // Funcs of adjoints that were not requested cost nothing.
  Derivative only = propagate_adjoints(loss, {.wrt = {a}});
  EXPECT_LT(value(only.operations().gradient.operations()),
            value(operations.gradient.operations()));
}

// Each iteration runs one step of a tape: a sine to restore the value, a cosine for the adjoint, and a third function
// for the gradient by the factors.
TEST(OperationCount, OneStepOfATapeRunsAtATime) {
  Buffer<float> a = line(6);
  Func f("f");
  RDom r(0, 6);
  f() = 1.0f;
  f() = sin(f()) * a(r);
  Derivative d = propagate_adjoints(f, {.overwritten = Overwritten::Store});
  EXPECT_EQ(value(d.operations().gradient.nonlinear()), 3 * 6);
}

}  // namespace
}  // namespace retrograde::gradient

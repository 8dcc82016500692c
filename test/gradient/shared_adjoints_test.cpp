// Tests which inner adjoints of a step are kept because several inputs need them: those that pay, and no others. The
// suite (programs_suite_test.cpp) checks that the gradients stay right.
#include "autodiff/sums/shared_adjoints.h"

#include <gtest/gtest.h>

#include "autodiff/derivative.h"
#include "autodiff/sums/generated_definitions.h"
#include "gradient/gradient_check.h"
#include "graph/definitions/define.h"
#include "graph/function.h"
#include "ir/build.h"
#include "support/facts.h"
#include "support/variables.h"

namespace retrograde::gradient {
namespace {

struct Steps {
  Buffer<float> input{8}, weight{6}, bias{6};
  Func h{"h"}, loss{"loss"};
  RDom r{0, 8};
  Steps() {
    for (int i = 0; i < 8; ++i) input(i) = 0.125f * static_cast<float>(i) - 0.5f;
    for (int i = 0; i < 6; ++i) weight(i) = 0.25f * static_cast<float>(i) - 0.5f, bias(i) = 0.375f;
  }
  Expr drive() { return weight(x) * input(r) + bias(x) * h(x, r); }
  void finish() {
    RDom all(0, 6, 0, 9);
    loss() = 0.0f;
    loss() += h(all.x, all.y) * h(all.x, all.y);
  }
};

Func inner_of(const Derivative& d) {
  for (const Func& f : d.funcs()) {
    if (f.name().find("_adj_inner") != std::string::npos) return f;
  }
  return {};
}

TEST(SharedAdjoints, AnInnerAdjointThatSeveralInputsNeedIsKept) {
  Steps s;
  s.h(x, t) = 0.0f;
  s.h(x, s.r + 1) = tanh(s.drive()) / (1.0f + exp(-s.drive()));
  s.finish();
  const Derivative d = propagate_adjoints(s.loss);
  const Func inner = inner_of(d);
  ASSERT_TRUE(inner.defined());
  EXPECT_EQ(inner.dimensions(), 2);
  EXPECT_EQ(inner.outputs(), 1) << "that of drive()";
  expect_fact(d.explanations(), Fact::Version, s.h.name(),
              "\"h_adj_inner\" keeps 1 inner adjoint of each iteration, shared by 3 contributions");
  const autodiff::OperationCount count = d.operations().gradient;
  const autodiff::FuncOperations* kept = count.find(inner.function().get());
  ASSERT_NE(kept, nullptr);
  EXPECT_TRUE(kept->stored);
  for (const Buffer<float>& b : {s.input, s.weight, s.bias}) {
    const autodiff::FuncOperations* gradient = count.find(d(b).function().get());
    ASSERT_NE(gradient, nullptr);
    for (const autodiff::StageOperations& stage : gradient->stages)
      EXPECT_EQ(stage.each.nonlinear, 0) << b.name();
  }
}

TEST(SharedAdjoints, WhatIsCheapIsComputedAgain) {
  Steps s;
  s.h(x, t) = 0.0f;
  s.h(x, s.r + 1) = s.drive();
  s.finish();
  EXPECT_FALSE(inner_of(propagate_adjoints(s.loss)).defined());
}

TEST(SharedAdjoints, OneInputNeedsNothingKept) {
  Steps s;
  s.h(x, t) = 0.0f;
  s.h(x, s.r + 1) = tanh(s.drive()) / (1.0f + exp(-s.drive()));
  s.finish();
  AdjointOptions options;
  options.wrt = {s.weight};
  EXPECT_FALSE(inner_of(propagate_adjoints(s.loss, options)).defined());
}

TEST(SharedAdjoints, AnAccumulationKeepsNothingForEachOfItsTerms) {
  Buffer<float> a(6), b(5);
  a.fill(0.5f), b.fill(0.25f);
  Func f("f"), loss("loss");
  RDom r(0, 5), all(0, 6);
  f(x) = 0.0f;
  f(x) += tanh(a(x) * b(r)) / (1.0f + exp(-a(x) * b(r))) + sin(a(x) * b(r));
  loss() = 0.0f;
  loss() += f(all) * f(all);
  EXPECT_FALSE(inner_of(propagate_adjoints(loss)).defined());
}

// a(i - 3) is read under a condition: the primal reads it from 0 on.
struct Guarded : ::testing::Test {
  Guarded() {
    using namespace autodiff;
    adjoint->name = "adjoint", a->name = "a", b->name = "b", c->name = "c";
    for (const FuncPtr& f : {adjoint, a, b, c}) define_pure(f, {variable("i")}, {Expr(0.0f)});
  }
  Expr read(const graph::FuncPtr& f, const Expr& i) { return autodiff::call_value(f, {i}, 0); }
  autodiff::SharedAdjoints share(int first) {
    using namespace autodiff;
    const Expr i = variable("i"), seed = read(adjoint, i);
    Expr inner = seed;
    for (int k = 0; k < 40; ++k) inner = inner * read(a, i - 3) + Expr(1.0f);
    const std::vector<LeafAdjoint> leaves{{read(b, i), inner * Expr(2.0f)},
                                          {read(c, i), inner * Expr(3.0f)}};
    const Regions regions({a, b, c}, {{a.get(), {{Expr(0), Expr(9)}}}});
    return share_adjoints("inner", {{{"i", Expr(first), Expr(9)}}, {}}, leaves, {seed}, regions);
  }
  graph::FuncPtr adjoint = graph::make_func(graph::Role::Adjoint),
                 a = std::make_shared<graph::FuncContents>(),
                 b = std::make_shared<graph::FuncContents>(),
                 c = std::make_shared<graph::FuncContents>();
};

TEST_F(Guarded, WhatIsReadInTheWholeDomainMayBeKept) { EXPECT_NE(share(3).func, nullptr); }
TEST_F(Guarded, WhatIsNotThereInAllOfTheDomainIsNotRead) { EXPECT_EQ(share(0).func, nullptr); }

}  // namespace
}  // namespace retrograde::gradient

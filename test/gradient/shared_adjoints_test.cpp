// Tests which inner adjoints of a step are kept because several inputs need them: those that pay, and no others. The
// suite (programs_suite_test.cpp) checks that the gradients stay right.
#include "autodiff/sums/shared_adjoints.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

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

// ---- terms of sums (shared_terms.h) ----

const Var i("i"), c("c");

Func with_name(const Derivative& d, const std::string& part) {
  for (const Func& f : d.funcs()) {
    if (f.name().find(part) != std::string::npos) return f;
  }
  return {};
}

// Many rays through a surface with three parameters, one after the other.
struct Rays {
  static constexpr int count = 5000;
  Buffer<float> start{count}, bend{1}, gap{1}, index{1};
  Func ray{"ray"}, loss{"loss"};
  RDom r{0, count};

  Rays() {
    for (int k = 0; k < count; ++k) start(k) = 0.001f * static_cast<float>(k % 700) - 0.25f;
    bend(0) = 0.25f, gap(0) = 1.5f, index(0) = 1.25f;
  }
  // The first values of a program of so many steps.
  Expr after(int steps) {
    const Expr zero = 0, b = bend(zero), g = gap(zero), n = index(zero);
    Expr at = start(i);
    for (int k = 0; k < steps; ++k) at = sqrt(at * at + g) / (n + b * at) + b * n;
    return at;
  }
  void finish() {
    loss() = 0.0f;
    loss() += ray(r) * ray(r);
  }
  // By each input alone, which shares nothing.
  float alone(const Buffer<float>& input) const {
    AdjointOptions options;
    options.wrt = {input};
    const Derivative d = propagate_adjoints(loss, options);
    EXPECT_FALSE(with_name(d, "_adj_terms").defined());
    return Buffer<float>(d(input).realize({1}))(0);
  }
};

TEST(SharedTerms, SumsOfALongProgramReadTheirTerms) {
  Rays rays;
  rays.ray(i) = rays.after(6);
  rays.finish();
  const Derivative d = propagate_adjoints(rays.loss);
  const Func terms = with_name(d, "_adj_terms");
  ASSERT_TRUE(terms.defined()) << d.explain(Detail::All);
  EXPECT_EQ(terms.outputs(), 4);
  expect_fact(d.explanations(), Fact::Version, rays.ray.name(),
              "\"ray_adj_terms\" keeps 4 terms of each iteration, shared by 4 contributions");
  for (const Buffer<float>& input : {rays.bend, rays.gap, rays.index}) {
    const float expected = rays.alone(input);
    EXPECT_NEAR(Buffer<float>(d(input).realize({1}))(0), expected, 1e-5f * std::abs(expected));
    const autodiff::FuncOperations* sum = d.operations().gradient.find(d(input).function().get());
    ASSERT_NE(sum, nullptr);
    for (const autodiff::StageOperations& stage : sum->stages)
      EXPECT_EQ(stage.each.nonlinear, 0) << input.name();
  }
}

TEST(SharedTerms, ShortProgramsAreComputedAgain) {
  Rays rays;
  rays.ray(i) = rays.after(1);
  rays.finish();
  EXPECT_FALSE(with_name(propagate_adjoints(rays.loss), "_adj_terms").defined());
}

// ---- choices as values (sweeps/chosen_values.h) ----

TEST(ChosenValues, AlternativesAreDifferentiatedInOneSweep) {
  const auto cost_and_gradient = [](bool chooses) {
    Rays rays;
    const Expr at = rays.after(3);
    Func pair("pair"), loss("loss");
    if (chooses)
      rays.ray(i, c) = select(c == 0, at * 2.0f, at * at);
    else
      pair(i) = {at * 2.0f, at * at}, rays.ray(i, c) = select(c == 0, pair(i)[0], pair(i)[1]);
    RDom both(0, Rays::count, 0, 2);
    loss() = 0.0f;
    loss() += rays.ray(both.x, both.y) * cast<float>(both.x % 7 + both.y);
    const Derivative d = propagate_adjoints(loss);
    const float found = Buffer<float>(d(rays.bend).realize({1}))(0);
    return std::pair(d.operations().gradient.operations().value().value_or(-1), found);
  };
  const auto [operations, found] = cost_and_gradient(true);
  const auto [expected_operations, expected] = cost_and_gradient(false);
  EXPECT_GT(operations, 0);
  EXPECT_LE(operations, 1.1 * expected_operations);
  EXPECT_NEAR(found, expected, 1e-5f * std::abs(expected));
}

}  // namespace
}  // namespace retrograde::gradient

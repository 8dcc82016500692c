// A reduction domain belongs to its definition: an update runs over its whole domain, even if
// folding removes all reduction variables from both sides. The same holds for the dimensions of the
// placeholder _.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <functional>

#include "autodiff/derivative.h"
#include "support/errors.h"
#include "support/variables.h"
#include "testing/interpreter.h"

namespace retrograde {
namespace {

int value_of(const Func& f) {
  Func copy = f;
  const Buffer<int> result = copy.realize(std::vector<int32_t>{});
  return result();
}

// f() = 0, then f() += value ten times.
int ten_times(const std::function<Expr(const RDom&)>& value) {
  const RDom r(0, 10);
  Func f("f");
  f() = 0;
  f() += value(r);
  return value_of(f);
}

TEST(FoldedDomains, OfProductsWithZero) {
  EXPECT_EQ(ten_times([](const RDom& r) { return 1 + r * 0; }), 10);
  EXPECT_EQ(ten_times([](const RDom& r) { return 1 + 0 * r; }), 10);
  EXPECT_EQ(ten_times([](const RDom& r) { return 1 + cast<uint8_t>(0) * cast<uint8_t>(r); }), 10);
}

TEST(FoldedDomains, OfQuotientsRemaindersAndDifferences) {
  EXPECT_EQ(ten_times([](const RDom& r) { return 1 + r % 1; }), 10);
  EXPECT_EQ(ten_times([](const RDom& r) { return 1 + r / 0; }), 10);
  EXPECT_EQ(ten_times([](const RDom& r) { return 1 + 0 / Expr(r); }), 10);
  const auto difference = [](const RDom& r) {
    const Expr e = r;
    return 1 + (e - e);
  };
  EXPECT_EQ(ten_times(difference), 10);
  EXPECT_EQ(ten_times([](const RDom& r) { return pow(Expr(r), 0); }), 10);
}

TEST(FoldedDomains, OfChoices) {
  EXPECT_EQ(ten_times([](const RDom& r) { return select(Expr(true), 1, Expr(r)); }), 10);
  EXPECT_EQ(ten_times([](const RDom& r) { return select(Expr(false), Expr(r), 1); }), 10);
  const auto same = [](const RDom& r) {
    const Expr one = 1;
    return select(r > 5, one, one);
  };
  EXPECT_EQ(ten_times(same), 10);
  EXPECT_EQ(ten_times([](const RDom& r) { return cast<int>(r > 5 || Expr(true)); }), 10);
  EXPECT_EQ(ten_times([](const RDom& r) { return 1 + cast<int>(Expr(false) && r > 5); }), 10);
  EXPECT_EQ(ten_times([](const RDom& r) { return mux(0, {Expr(1), Expr(r)}); }), 10);
  const auto itself = [](const RDom& r) {
    const Expr e = r;
    return cast<int>(e == e);
  };
  EXPECT_EQ(ten_times(itself), 10);
}

TEST(FoldedDomains, StartFromTheFirstDefinition) {
  RDom r(0, 10);
  Func f("f");
  f() = 1;
  f() += 1 + r * 0;
  EXPECT_EQ(value_of(f), 11);
  Func product("product");
  product() = 1;
  product() *= 2 + r * 0;
  EXPECT_EQ(value_of(product), 1024);
}

TEST(FoldedDomains, OfTuples) {
  RDom r(0, 10);
  Func f("f");
  f() = Tuple(0, 1.0f);
  f() = Tuple(f()[0] + (r % 1) + 2, f()[1] * 2);
  Realization both = f.realize(std::vector<int32_t>{});
  EXPECT_EQ(both[0].as<int>()(), 20);
  EXPECT_EQ(both[1].as<float>()(), 1024.0f);
}

TEST(FoldedDomains, OfPlacesOnTheLeft) {
  RDom r(0, 10);
  Func f("f");
  f(x) = 0;
  f(r * 0 + 2) += 1;
  const Buffer<int> result = f.realize({4});
  EXPECT_EQ(result(2), 10);
  EXPECT_EQ(result(1), 0);
  // Only the pure variable remains, so the update covers all of its values.
  Func g("g");
  g(x) = 0;
  g(x + r * 0) += x;
  const Buffer<int> all = g.realize({4});
  EXPECT_EQ(all(3), 30);
}

TEST(FoldedDomains, UnderPredicates) {
  RDom r(0, 10);
  r.where(r % 2 == 0);
  Func f("f");
  f() = 0;
  f() += 1 + r * 0;
  EXPECT_EQ(value_of(f), 5);
  RDom all(0, 10);
  all.where(all * 0 == 0);
  Func g("g");
  g() = 0;
  g() += 1 + all * 0;
  EXPECT_EQ(value_of(g), 10);
}

TEST(FoldedDomains, OfManyVariables) {
  RDom r(0, 3, 0, 4);
  Func f("f");
  f() = 0;
  f() += 1 + r.y * 0;
  EXPECT_EQ(value_of(f), 12);
}

TEST(FoldedDomains, OfInlineReductions) {
  RDom r(0, 10);
  Func f("f"), g("g"), h("h"), k("k"), m("m");
  f() = sum(r * 0 + 1);
  g() = product(r % 1 + 2);
  h() = maximum(0 * r + 7);
  k() = argmin(r * 0 + 3)[1];
  m() = sum(r, Expr(2));
  EXPECT_EQ(value_of(f), 10);
  EXPECT_EQ(value_of(g), 1024);
  EXPECT_EQ(value_of(h), 7);
  EXPECT_EQ(value_of(k), 3);
  EXPECT_EQ(value_of(m), 20);
}

TEST(FoldedDomains, AroundInlineReductions) {
  RDom outer(0, 3), inner(0, 4);
  Func f("f"), g("g");
  f() = 0;
  f() += sum(inner, 1 + outer * 0);
  EXPECT_EQ(value_of(f), 12);
  g() = 0;
  g() += 1 + 0 * sum(inner, outer + inner);
  EXPECT_EQ(value_of(g), 3);
}

TEST(FoldedDomains, AtSeveralPoints) {
  RDom r(0, 10);
  Func f("f");
  f(x) = 0;
  f(scatter(0, 1)) = gather(r * 0 + 3, r * 0 + 4);
  const Buffer<int> result = f.realize({2});
  EXPECT_EQ(result(0), 3);
  EXPECT_EQ(result(1), 4);
  EXPECT_EQ(f.function()->updates[0].rvars.size(), 2u);
}

TEST(FoldedDomains, OfSchedulesAndTheInterpreter) {
  RDom r(0, 12);
  Func f("f");
  f(x) = 0;
  f(x) += x + r * 0;
  RVar ro("ro"), ri("ri");
  f.update().split(r, ro, ri, 5).reorder(x, ri, ro).vectorize(x, 4);
  const Buffer<int> result = f.realize({8});
  const auto array = oracle::Interpreter().realize(f.function(), {{0}, {8}})[0];
  for (int i = 0; i < 8; i++) {
    EXPECT_EQ(result(i), 12 * i);
    EXPECT_EQ(array.values[static_cast<size_t>(i)].scalar.i, 12 * i);
  }
}

TEST(FoldedDomains, OfGradients) {
  RDom r(0, 10);
  Param<float> p("p", 3.0f);
  Func f("f");
  f() = 0.0f;
  f() += p * p + cast<float>(r * 0);
  Func d = propagate_adjoints(f)(p);
  const Buffer<float> gradient = d.realize(std::vector<int32_t>{});
  EXPECT_EQ(gradient(), 60.0f);
}

TEST(FoldedDomains, AreRefusedWhereTheyWouldBeUnfolded) {
  RDom r(0, 10), s(0, 5);
  Func f("f"), g("g");
  expect_error({"first definition has no reduction variables"}, [&] { f() = r * 0 + 1; });
  g() = 0;
  expect_error({"come from one RDom"}, [&] { g() += r * 0 + s; });
  expect_error({"bounds must be known before any loop starts"}, [&] { RDom t(0, r * 0 + 3); });
}

// Folding still applies: no slower code remains.
TEST(FoldedDomains, LeaveFoldedDefinitions) {
  RDom r(0, 10);
  Func f("f");
  f() = 0;
  f() += 1 + r * 0;
  const graph::Definition& update = f.function()->updates[0];
  EXPECT_FALSE(any_node(update.values[0], [](const ir::Mul&) { return true; }));
  EXPECT_FALSE(ir::has_loose_names(update.values[0]));
}

TEST(ImplicitVariables, SayHowManyDimensionsThereAre) {
  Func f("f"), g("g");
  f(x, y) = x + y;
  g(_) = f(_) * 0 + 1;
  EXPECT_EQ(g.dimensions(), 2);
  const Buffer<int> result = g.realize({3, 3});
  EXPECT_EQ(result(2, 2), 1);
}

}  // namespace
}  // namespace retrograde

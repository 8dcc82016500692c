// Programs that cannot be differentiated: each error has its class, its four parts and the names in it.
#include <gtest/gtest.h>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"
#include "frontend/language/inline_reductions.h"
#include "support/errors.h"
#include "support/facts.h"
#include "support/variables.h"

namespace retrograde {
namespace {

struct Gradients : ::testing::Test {
  Buffer<float> a{8};
  Func f{"f"}, loss{"loss"};
  const AdjointOptions strict{.overwritten = Overwritten::Refuse};
  void sum_up() {
    RDom r(0, 8);
    loss() = 0.0f;
    loss() += f(r);
  }
};

TEST_F(Gradients, OverwrittenValueThatAPartialNeeds) {
  f(x) = a(x);
  f(x) = f(x) * f(x);
  sum_up();
  expect_error<UserError>({"differentiate the update \"f", "Overwritten::Store"},
                          [&] { propagate_adjoints(loss, strict); });
}

TEST_F(Gradients, ProductInPlace) {
  RDom r(0, 8);
  f(x) = 1.0f;
  f(x) *= a(r);
  sum_up();
  expect_error<UserError>({"\"f", "Overwritten::Store"}, [&] { propagate_adjoints(loss, strict); });
}

// rule: a partial derivative may need only values that are still there
TEST_F(Gradients, ValueOverwrittenByALaterUpdate) {
  f(x) = a(x);
  RDom r(1, 7), q(0, 8);
  f(r) = f(r) + f(r - 1) * f(r - 1);
  f(q) = f(q) * 2.0f;
  sum_up();
  expect_error<UserError>({"overwrote"}, [&] { propagate_adjoints(loss, strict); });
  EXPECT_NO_THROW(propagate_adjoints(loss, {.overwritten = Overwritten::Store}));
}

TEST_F(Gradients, PlaceThatDependsOnAnOverwrittenValueOfTheFuncItself) {
  f(x) = a(x);
  RDom r(0, 8);
  f(clamp(cast<int>(f(r)), 0, 7)) += a(r);
  sum_up();
  expect_error<UserError>({"\"f", "Overwritten::Store"}, [&] { propagate_adjoints(loss, strict); });
}

TEST_F(Gradients, PredicateThatDependsOnTheFuncItself) {
  f(x) = a(x);
  RDom r(0, 8);
  r.where(f(r) > 1.0f);
  f(r) = a(r) * 2.0f;
  sum_up();
  expect_error<UserError>({"\"f", "whether an update writes", "select"},
                          [&] { propagate_adjoints(loss); });
}

TEST_F(Gradients, UpdateThatReachesElementsWithoutBounds) {
  f(x) = a(clamp(x, 0, 7));
  RDom r(0, 8);
  f(r) = f(cast<int>(a(r))) * 2.0f;
  Func g("g");
  g(x) = f(cast<int>(a(x)));
  RDom q(0, 8);
  loss() = 0.0f;
  loss() += g(q);
  expect_error<Unsupported>({"\"f", "bounds", "Clamp"}, [&] { propagate_adjoints(loss); });
}

// Values that other Funcs read have bounds: elements beyond them count where the update reads them.
TEST_F(Gradients, UpdateThatReadsElementsWithoutBounds) {
  for (bool accumulates : {false, true}) {
    Func reads("reads");
    RDom r(0, 8);
    reads(x) = a(clamp(x, 0, 7));
    const Expr read = reads(cast<int>(a(r))) * 2.0f;
    if (accumulates)
      reads(0) += read;
    else
      reads(r) = read;
    Func sum("sum");
    sum() = reads(0) + reads(1);
    expect_error<Unsupported>({"\"reads", "bounds", "Clamp"}, [&] { propagate_adjoints(sum); });
  }
}

TEST_F(Gradients, IntegerOutput) {
  f(x) = cast<int>(a(x));
  expect_error<UserError>({"\"f", "int32", "float"}, [&] { propagate_adjoints(f); });
}

TEST_F(Gradients, UndefinedOutput) {
  expect_error<UserError>({"\"f", "defined"}, [&] { propagate_adjoints(f); });
}

TEST_F(Gradients, BoundsOfWrongRank) {
  f(x) = a(x);
  Func seed("seed");
  seed(x) = 1.0f;
  expect_error<UserError>({"1 dimensions", "2 bounds"}, [&] {
    propagate_adjoints(f, seed, Region{{0, 8}, {0, 8}});
  });
}

TEST_F(Gradients, AdjointOfWrongRank) {
  f(x) = a(x);
  Buffer<float> seed(4, 4);
  expect_error<UserError>({"dimensions"}, [&] { propagate_adjoints(f, seed); });
}

TEST_F(Gradients, ZeroGradientsSayWhy) {
  Buffer<uint8_t> bytes(8);
  Func g("g");
  g(x) = floor(a(x)) + cast<float>(bytes(x));
  f(x) = g(x) * 2.0f;
  sum_up();
  Derivative d = propagate_adjoints(loss);
  expect_fact(d.explanations(), Fact::Zero, g.name(),
              "floor has derivative 0 (constant between steps; 0 at the steps by convention)");
  expect_fact(d.explanations(), Fact::Zero, bytes.name(),
              "its type is uint8: integers have no derivative");
  EXPECT_EQ(Buffer<float>(d(bytes).realize({8}))(3), 0.0f);
  ASSERT_TRUE(d(a).defined()) << "a float that the output reads has a gradient, here zero";
  EXPECT_EQ(d(a).num_update_definitions(), 0);
}

// Sizes whose number of elements has no 32-bit index are refused before anything is allocated.
TEST(GradientErrors, SizesBeyondThirtyTwoBitsAreRefused) {
  Var x("x");
  const int n = 50000;
  ImageParam place(Int(32), 1, "place"), a(Float(32), 1, "a");
  auto expect_refused = [&](const Func& f, const AdjointOptions& options, const char* what) {
    Func loss("loss");
    loss() = f(Expr(0)) * 2.0f;
    expect_error<Unsupported>({what, "2147483647", "Split its loops"},
                              [&] { propagate_adjoints(loss, options); });
  };
  const AdjointOptions store{.overwritten = Overwritten::Store};
  {
    Func f("f");
    RDom r(0, n, 0, n);
    f(x) = a(x);
    f(clamp(place(r.x), 0, 9)) = f(clamp(place(r.y), 0, 9)) * a(r.x);
    expect_refused(f, store, "slots of a tape");
  }
  {
    Func f("f");
    RDom r(0, n, 0, n);
    f(x) = a(x);
    f(x) = f(x) * a(r.x) * a(r.y);
    expect_refused(f, store, "kept steps of an update");
  }
  {
    Func f("f");
    RDom r(0, n, 0, n);
    f(x) = a(x);
    f(x) = max(f(x), a(r.x) * a(r.y));
    expect_refused(f, {}, "iterations of an update that selects");
  }
  {
    Func f("f");
    RDom r(0, 1000000, 0, 10000);
    f(x) = a(x);
    f(r.x) = sin(f(999999 - r.x)) * a(r.x);
    expect_refused(f, {.checkpoint_states = 3000}, "slots of a loop with checkpoints");
  }
}

}  // namespace
}  // namespace retrograde

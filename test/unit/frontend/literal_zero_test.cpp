// A literal 0 is also a null pointer. Where a user means a number, it must not become the null name
// of a Var, and where it has no meaning, it must not compile. Null pointers are reported.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <string>
#include <vector>

#include "support/errors.h"

namespace retrograde {
namespace {

template <typename T>
concept IsMadeOfZero = requires {
  T(0);
};
template <typename T>
concept IsMadeOfNull = requires {
  T(nullptr);
};
static_assert(!IsMadeOfZero<Var> && !IsMadeOfNull<Var>);
static_assert(!IsMadeOfZero<RVar> && !IsMadeOfNull<RVar>);
static_assert(!IsMadeOfZero<Func> && !IsMadeOfNull<Func>);
static_assert(!IsMadeOfZero<VarOrRVar>);
static_assert(!IsMadeOfZero<Target> && !IsMadeOfNull<Target>);
static_assert(!IsMadeOfNull<Param<void*>>);
static_assert(IsMadeOfZero<Param<float>> && IsMadeOfZero<Param<uint8_t>>);

template <typename R, typename... Rest>
concept IsReducedWithZero = requires(const R& r, const Rest&... rest) {
  sum(r, rest..., 0);
};
static_assert(IsReducedWithZero<RDom>);  // the sum of zeros
static_assert(!IsReducedWithZero<Expr> && !IsReducedWithZero<RDom, Expr>);

class LiteralZero : public ::testing::Test {
 protected:
  LiteralZero() {
    f(x, y) = 10 * x + y;
    image.for_each_element([&](int i, int j) { image(i, j) = 10 * i + j; });
  }
  // The value of e at x = 2.
  int at_two(const Expr& e) const {
    Func g;
    g(x) = e;
    return Buffer<int>(g.realize({3}))(2);
  }
  Var x{"x"}, y{"y"};
  Func f{"f"};
  Buffer<int> image{3, 3};
};

TEST_F(LiteralZero, IsACoordinateAmongBraces) {
  EXPECT_EQ(at_two(f({x, 0})), 20);
  EXPECT_EQ(at_two(f({0, x})), 2);
  EXPECT_EQ(at_two(f({0, 0})), 0);
  EXPECT_EQ(at_two(image({x, 0})), 20);
  EXPECT_EQ(at_two(image({0, x})), 2);
  ImageParam given(Int(32), 2);
  given.set(image);
  EXPECT_EQ(at_two(given({x, 0})), 20);
  EXPECT_EQ(at_two(given({0, x})), 2);
}

TEST_F(LiteralZero, IsWhereAnUpdateStores) {
  Func g;
  g(x) = 1;
  g({0}) = 5;
  Buffer<int> values = g.realize({2});
  EXPECT_EQ(values(0), 5);
  EXPECT_EQ(values(1), 1);
}

TEST_F(LiteralZero, IsAnEndOfADomain) {
  for (const RDom& r : {RDom{0, 4}, RDom({0, 4}), RDom({{0, 4}}), RDom{{0, 4}}}) {
    Func g;
    g() = 0;
    g() += r.x;
    EXPECT_EQ(Buffer<int>(g.realize())(), 6);
  }
}

TEST_F(LiteralZero, IsTheValueOfAParam) {
  EXPECT_EQ(Param<float>(0).get(), 0.0f);
  EXPECT_EQ(Param<uint8_t>(0).get(), 0);
  EXPECT_FALSE(Param<bool>(0).get());
}

TEST_F(LiteralZero, IsASize) {
  Func g;
  g(x) = x;
  EXPECT_EQ(Buffer<int>(g.realize({0})).width(), 0);
  Pipeline p(g);
  EXPECT_EQ(Buffer<int>(p.realize({0})).width(), 0);
}

TEST_F(LiteralZero, IsSummed) {
  RDom r(0, 4);
  EXPECT_EQ(at_two(sum(r, 0)), 0);
  EXPECT_EQ(at_two(maximum(r, 0)), 0);
}

// rule: a name is text
TEST(NullText, IsAnError) {
  const char* const none = nullptr;
  const auto expect_null = [](const auto& make, const char* what) {
    expect_error({what, "is null"}, make);
  };
  expect_null([&] { Var v(none); }, "name a Var");
  expect_null([&] { RVar v(none); }, "name an RVar");
  expect_null([&] { Func f(none); }, "name a Func");
  expect_null([&] { Param<int> p(none); }, "name a Param");
  expect_null([&] { Expr e(none); }, "make an Expr from a text");
  expect_null([&] { Target t(none); }, "read a target");
}

TEST(Features, OutOfRangeAreAnError) {
  for (int i : {-1, Target::FeatureEnd + 1, 100000}) {
    const auto feature = static_cast<Target::Feature>(i);
    const auto expect_refused = [&](const auto& use) {
      expect_error({"a feature is one of Target::Feature", std::to_string(i).c_str()}, use);
    };
    Target t;
    expect_refused([&] { t.set_feature(feature); });
    expect_refused([&] { t.has_feature(feature); });
    expect_refused([&] { t.with_feature(feature); });
    expect_refused([&] { t.without_feature(feature); });
    expect_refused([&] { t.features_any_of({feature}); });
    expect_refused([&] { Target(Target::Linux, Target::X86, 64, {feature}); });
  }
}

}  // namespace
}  // namespace retrograde

// Tightness of interval arithmetic on typical index expressions.
// property/interval_property_test.cpp checks soundness.
#include "analysis/interval.h"

#include <gtest/gtest.h>

#include "analysis/linear.h"
#include "ir/build.h"
#include "ir/print.h"

namespace retrograde::analysis {
namespace {

Expr var(const char* name) { return variable(name, Int(32)); }

class IntervalTest : public testing::Test {
 protected:
  IntervalTest() {
    scope.push("x", {var("xmin"), var("xmax")});
    scope.push("i", {0, 7});
    scope.push("s", {-5, 5});
    scope.push("anything", Interval::everything());
  }
  std::string bounds(const Expr& e, const ValueBounds* values = nullptr) {
    Interval v = bounds_of(e, scope, values);
    auto end = [](const Expr& x) { return x.defined() ? print(x) : std::string("?"); };
    return "[" + end(v.min) + ", " + end(v.max) + "]";
  }
  static std::string interval(const Expr& min, const Expr& max) {
    return "[" + print(min) + ", " + print(max) + "]";
  }

  Scope<Interval> scope;
  Expr x = var("x"), i = var("i"), s = var("s"), n = var("n"), anything = var("anything");
  Expr xmin = var("xmin"), xmax = var("xmax");
};

TEST_F(IntervalTest, ShiftedAndScaled) {
  EXPECT_EQ(bounds(x + 3 - 1), interval(xmin + 2, xmax + 2));
  EXPECT_EQ(bounds(x * 2), interval(xmin * 2, xmax * 2));
  EXPECT_EQ(bounds(7 - x), interval(7 - xmax, 7 - xmin));
  EXPECT_EQ(bounds(i * -3), "[-21, 0]");
}

TEST_F(IntervalTest, WhatDoesNotVaryIsAPoint) {
  Interval v = bounds_of(n * n + 1, scope);
  EXPECT_TRUE(v.is_point());
}

TEST_F(IntervalTest, CorrelatedTermsCancel) {
  EXPECT_EQ(bounds((x + 1) - x), "[1, 1]");
  EXPECT_EQ(bounds(x - x / 2 * 2), "[0, 1]");
  EXPECT_EQ(bounds((x + i) * 2 - x * 2), "[0, 14]");
}

// The last vector of the last tile begins within the tiles.
TEST_F(IntervalTest, SidesOfAMinimumCancelWithWhatStandsBesideIt) {
  EXPECT_EQ(bounds(i * 16 + min(40 - i * 16, 8)), "[8, 40]");
  EXPECT_EQ(bounds(i * 16 + max(min(5 - i * 2, 1), 0) * 8), "[8, 112]");
  EXPECT_EQ(bounds(i - max(i - 3, 0)), "[0, 3]");
  EXPECT_EQ(bounds(min(i, 5) - max((i - 2) / 2, 0) * 2), "[0, 3]");
  EXPECT_EQ(bounds(i + max(i, 3)), "[3, 14]");  // they do not cancel
  // Both operands vary: rows of a seed below tap rows that begin where the seed does.
  EXPECT_EQ(bounds(min(i, 5) - max(i - 3, 0)), "[0, 3]");
  EXPECT_EQ(bounds(min(i, 5) - max((i - 2) / 2, 0) * 2), "[0, 3]");
}

TEST_F(IntervalTest, DivisionTakesOutMultiples) {
  EXPECT_EQ(bounds((n * 8 + i) / 8), interval(n, n));
  EXPECT_EQ(bounds((n * 8 + i) % 8), "[0, 7]");
  EXPECT_EQ(bounds(s / 2), "[-3, 2]");
  EXPECT_EQ(bounds(s / -2), "[-2, 3]");
  EXPECT_EQ(bounds(i / 4), "[0, 1]");
}

TEST_F(IntervalTest, RemainderWithinOnePeriodIsTight) {
  scope.push("small", {9, 11});
  EXPECT_EQ(bounds(var("small") % 8), "[1, 3]");
  EXPECT_EQ(bounds(i % 5), "[0, 4]");
  scope.push("near", {n * 8 + 2, n * 8 + 5});
  EXPECT_EQ(bounds(var("near") % 8), "[2, 5]");
}

// Tiles of 16 from a to b: the last one begins at or before b, for any a.
TEST_F(IntervalTest, TheLastOfTilesBeginsBeforeTheirEnd) {
  scope.push("a", {0, 48});
  scope.push("b", {n + 15, n + 63});
  const Expr a = var("a"), b = var("b"), from = var("from");
  EXPECT_EQ(bounds(a + (b - a) / 16 * 16), "[n, n + 63]");
  EXPECT_EQ(bounds(from + (b - from) / 16 * 16),
            "[from + (n - from + 15) / 16 * 16, from + (n - from + 15) / 16 * 16 + 48]");
}

TEST_F(IntervalTest, ClampBoundsTheUnbounded) {
  EXPECT_EQ(bounds(clamp(anything, 0, 255)), "[0, 255]");
  Expr loaded = call_image("in", Float(32), {x}, {});
  EXPECT_EQ(bounds(clamp(cast(Int(32), loaded * 8.0f), 0, 7)), "[0, 7]");
  EXPECT_EQ(bounds(cast(Int(32), clamp(loaded, 0.0f, 1.0f) * 8.0f)), "[0, 8]");
  EXPECT_EQ(bounds(cast(Int(32), call_op(Op::floor, {clamp(loaded, 0.0f, 1.0f) * 7.5f}))),
            "[0, 7]");
}

// The ends round like the value: 4097 * 4097 - 16785408 is 1, but 0 with a rounded product.
TEST_F(IntervalTest, FmaLiesBetweenItsCorners) {
  Expr whole = cast(Float(32), i);  // 0 to 7
  EXPECT_EQ(bounds(cast(Int(32), call_op(Op::fma, {whole, Expr(-2.0f), Expr(3.0f)}))), "[-11, 3]");
  EXPECT_EQ(bounds(cast(Int(32), call_op(Op::fma, {whole, whole - 2.0f, whole}))), "[-14, 42]");
  Expr large = clamp(whole, 4097.0f, 4097.0f);
  EXPECT_EQ(bounds(cast(Int(32), call_op(Op::fma, {large, large, Expr(-16785408.0f)}))), "[1, 1]");
  Expr loaded = call_image("in", Float(32), {x}, {});
  EXPECT_EQ(bounds(cast(Int(32), call_op(Op::fma, {loaded, whole, whole}))), "[?, ?]");
}

TEST_F(IntervalTest, AValueThatMayBeNaNHasNoBounds) {
  Expr loaded = call_image("in", Float(32), {x}, {});
  EXPECT_EQ(bounds(cast(Int(32), loaded)), "[?, ?]");
  // A NaN on the right passes through min.
  EXPECT_EQ(bounds(cast(Int(32), max(Expr(0.0f), min(Expr(1.0f), loaded)))), "[?, ?]");
}

TEST_F(IntervalTest, NarrowTypesHaveTheirRange) {
  EXPECT_EQ(bounds(cast(Int(32), call_image("in", UInt(8), {x}, {}))), "[0, 255]");
  EXPECT_EQ(bounds(cast(Int(32), call_image("in", UInt(8), {x}, {})) + 1), "[1, 256]");
  Expr wraps = call_image("in", UInt(8), {x}, {}) + make_const(UInt(8), 1);
  EXPECT_EQ(bounds(cast(Int(32), wraps)), "[0, 255]");
  Expr a = call_image("a", UInt(8), {x}, {}), b = call_image("b", UInt(8), {x}, {});
  EXPECT_EQ(bounds(cast(Int(32), call_op(Op::absd, UInt(8), {a, b}))), "[0, 255]");
  EXPECT_EQ(bounds(call_op(Op::bitwise_and, {cast(Int(32), a), Expr(15)})), "[0, 15]");
  EXPECT_EQ(bounds(call_op(Op::shift_right, {cast(Int(32), a), Expr(4)})), "[0, 15]");
}

TEST_F(IntervalTest, MagnitudesOfIndicesHaveSymbolicEnds) {
  Expr far = call_op(Op::abs, UInt(32), {x - n}), from_zero = call_op(Op::absd, UInt(32), {x, 0});
  EXPECT_EQ(bounds(cast(Int(32), far)), interval(0, max(xmax - n, n - xmin)));
  EXPECT_EQ(bounds(cast(Int(32), from_zero)), interval(0, max(xmax, xmin * -1)));
}

TEST_F(IntervalTest, WideningIsFollowedIntoTheNarrowerSum) {
  EXPECT_EQ(bounds(cast_to(Int(64), i)), "[0_i64, 7_i64]");
  EXPECT_EQ(bounds(cast_to(Int(64), i * 2 + 1)), "[1_i64, 15_i64]");
  Expr widened = cast_to(Int(64), x);
  EXPECT_TRUE(canonical(widened).same_as(widened));
}

TEST_F(IntervalTest, MinAndMaxOfShiftedTermsAreDecided) {
  EXPECT_EQ(bounds(min(x + 1, x + 3)), interval(xmin + 1, xmax + 1));
  EXPECT_EQ(print(hull({xmin - 1, xmax - 1}, {xmin + 1, xmax + 1}).min), print(xmin - 1));
  EXPECT_EQ(print(canonical_min(n, canonical_max(n, xmin))), print(n));
}

TEST_F(IntervalTest, SelectNarrowsByItsCondition) {
  EXPECT_EQ(bounds(select(s < 0, 0 - s, s)), "[0, 5]");
  EXPECT_EQ(bounds(select(i < 10, s, anything)), "[-5, 5]");
  EXPECT_EQ(bounds(select(s >= 0 && s <= 2, s, Expr(1))), "[0, 2]");
}

TEST_F(IntervalTest, LetsAndPromisesAreFollowed) {
  EXPECT_EQ(bounds(make_let("t", x + 1, variable("t", Int(32)) * 2)),
            interval(xmin * 2 + 2, xmax * 2 + 2));
  EXPECT_EQ(bounds(call_op(Op::unsafe_promise_clamped, {anything, Expr(0), n - 1})),
            interval(Expr(0), max(n - 1, 0)));
}

// A user's promise may be broken; one that a split makes is not.
TEST_F(IntervalTest, PromisesOfTheCompilerBoundBothEnds) {
  EXPECT_EQ(bounds(call_op(Op::promise_clamped, Int(32), {anything, i * 4, n - 1})),
            interval(Expr(0), n - 1))
      << "not 28, if n is small";
  EXPECT_EQ(bounds(call_op(Op::promise_clamped, Int(32), {i * 4 + 3, i * 4, n - 1})),
            interval(Expr(3), min(31, n - 1)));
}

TEST_F(IntervalTest, ValuesOfFuncsComeFromTheCaller) {
  Expr f = call_func("f", Int(32), {x}, 0, {});
  EXPECT_EQ(bounds(f), "[?, ?]");
  ValueBounds values{{{"f", 0}, {3, 9}}};
  EXPECT_EQ(bounds(f + 1, &values), "[4, 10]");
}

TEST_F(IntervalTest, FootprintIsTheHullOfAllReads) {
  Expr f = call_func("f", Float(32), {x - 1, i}, 0, {}) +
           call_func("f", Float(32), {x + 2, i * 2}, 0, {});
  auto found = footprints(f, scope);
  ASSERT_EQ(found.size(), 1u);
  const Box& box = found["f"].box;
  EXPECT_EQ(print(box[0].min), print(xmin - 1));
  EXPECT_EQ(print(box[0].max), print(xmax + 2));
  EXPECT_EQ(print(box[1].max), "14");
}

TEST_F(IntervalTest, FootprintUnderAConditionIsNarrowed) {
  Expr read = call_image("in", Int(32), {s}, {});
  Expr guarded = call_op(Op::if_then_else, Int(32), {s >= 0, read, Expr(0)});
  EXPECT_EQ(print(footprints(guarded, scope)["in"].box[0].min), "0");
  // Both arms of a select may be evaluated.
  EXPECT_EQ(print(footprints(select(s >= 0, read, Expr(0)), scope)["in"].box[0].min), "-5");
}

TEST_F(IntervalTest, SharedNodesCostOnce) {
  Expr e = i;
  for (int k = 0; k < 200; ++k) e = min(e * e / 7, Expr(100)) + select(e < 3, e, Expr(5));
  EXPECT_TRUE(bounds_of(e, scope).has_upper_bound());
}

TEST_F(IntervalTest, LinearFormsGatherTerms) {
  EXPECT_EQ(constant_difference(x * 3 + n, n + x + x * 2 - 4), 4);
  EXPECT_FALSE(constant_difference(x, n));
  auto d = decompose(x * 2 - i + n * 4 + 1, {"x", "i"});
  ASSERT_TRUE(d);
  EXPECT_EQ(d->coefficients[0].second, 2);
  EXPECT_EQ(d->coefficients[1].second, -1);
  EXPECT_EQ(print(d->rest), print(n * 4 + 1));
  EXPECT_FALSE(decompose(x * x, {"x"}));
}

// The two are comparable through the operands of both.
TEST_F(IntervalTest, MinAndMaxOfClampsKeepTheOneThatDecides) {
  const Expr below = canonical_max(n - 2, 0), above = canonical_max(n - 1, 0);
  EXPECT_EQ(print(canonical_min(above, below)), print(below));
  EXPECT_EQ(constant_difference(canonical_max(below, above), canonical_max(0, n - 1)), 0);
  const Expr clamped = min(max(n - 1, 0), 9), next = min(max(n, 0), 9);
  EXPECT_EQ(print(canonical_min(clamped, next)), print(clamped));
  const Expr promised = call_op(Op::promise_clamped, Int(32), {n, 0, 9});
  EXPECT_EQ(print(canonical_max(promised - 1, min(max(promised, 0), 9))),
            print(min(max(promised, 0), 9)));
  EXPECT_EQ(print(canonical_min(above, max(xmin - 2, 0))), print(min(above, max(xmin - 2, 0))));
}

// If a number does not fit 64 bits, the bounds are unknown; nothing overflows.
TEST_F(IntervalTest, NumbersAtTheEndOfInt64) {
  constexpr int64_t most = INT64_MAX;
  const Expr a = variable("a", Int(64)), b = variable("b", Int(64));
  EXPECT_EQ(constant_difference(a + most, a + (most - 1)), 1);
  EXPECT_FALSE(constant_difference(a + most, a - 2));
  EXPECT_FALSE(nonnegative_where(a + most > b - 5));
  EXPECT_TRUE(solve_for(a + most <= b, "a", Scope<Interval>()));
  EXPECT_FALSE(solve_for(a + most < b, "a", Scope<Interval>()));
  const Expr shifted = min(a + 10, b) + most;
  EXPECT_EQ(print(canonical_min(shifted, b)), print(min(shifted, b)));
  EXPECT_EQ(print(canonical(a * 3 * most)), print(a * 3 * most));
  scope.push("a", {variable("low", Int(64)), {}});
  EXPECT_EQ(bounds(select(a + most < b, a, cast(Int(64), 0))), "[min(low:int64, 0_i64), ?]");
}

TEST_F(IntervalTest, ConditionsAreSolved) {
  Scope<Interval> inner;
  inner.push("i", {0, 7});
  auto solution = solve_for(x * 8 + i < n, "x", inner);
  ASSERT_TRUE(solution);
  EXPECT_FALSE(solution->interval.min.defined());
  EXPECT_EQ(constant_difference(solution->interval.max, (n - 8) / 8), 0);
  solution = solve_for(x - 1 >= 0 && x / 2 < n, "x", inner);
  ASSERT_TRUE(solution);
  EXPECT_EQ(print(solution->interval.min), "1");
  EXPECT_EQ(constant_difference(solution->interval.max, n * 2 - 1), 0);
  EXPECT_FALSE(solve_for(x * n < 3, "x", inner));
}

// Vectors of 16 over a box that the end n cuts off: all of them are inside if the box of 64 is, x * 64 + 63 <= n.
TEST_F(IntervalTest, ConditionsOnTheEndOfABoxAreSolved) {
  const Expr last = min(n, x * 64 + 63);
  Scope<Interval> inner;
  inner.push("v", {0, (last - x * 64) / 16});
  inner.push("lane", {0, 15});
  const Expr v = variable("v"), lane = variable("lane");
  const auto solution = solve_for(v * 16 + x * 64 + lane <= last, "x", inner);
  ASSERT_TRUE(solution);
  EXPECT_FALSE(solution->interval.min.defined());
  EXPECT_EQ(print(solution->interval.max), "(n + 1) / 16 * 16 / 64 - 1");  // (n - 63) / 64
}

}  // namespace
}  // namespace retrograde::analysis

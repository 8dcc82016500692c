// Periods of index expressions: how far a variable moves before quotients and remainders repeat.
#include "analysis/periods.h"

#include <gtest/gtest.h>

#include "ir/build.h"

namespace retrograde::analysis {
namespace {

const Expr x = variable("x"), y = variable("y");
int64_t period(const Expr& e) { return period_in(e, "x"); }

TEST(Periods, OfSumsAndMultiplesAreOne) {
  EXPECT_EQ(period(x + 3 * y), 1);
  EXPECT_EQ(period(y / 4), 1);
  EXPECT_EQ(period((4 * x + y) / 2), 1);
}

TEST(Periods, OfDivisionsFollowFromTheFactor) {
  EXPECT_EQ(period(x / 2), 2);
  EXPECT_EQ(period((3 * x + y) % 4), 4);
  EXPECT_EQ(period((2 * x + y) / 6), 3);
  EXPECT_EQ(period(likely(1 - x) / 5), 5);
}

TEST(Periods, OfSeveralDivisionsAreTheirCommonMultiple) {
  EXPECT_EQ(period((x / 2 + 1) % 3), 6);
  EXPECT_EQ(period(x / 2 + x % 3), 6);
  EXPECT_EQ(period(max(x / 4, x % 6)), 12);
}

TEST(Periods, AreUnknownBehindOtherOperations) {
  EXPECT_EQ(period(min(x, 7) / 2), 0);
  EXPECT_EQ(period(max(likely(x), y) / 2), 0);
  EXPECT_EQ(period(x / y), 0);
  EXPECT_EQ(period(x % 2 + x / (y + 1)), 0);
}

TEST(Periods, AreNoLongerThanALimit) {
  EXPECT_EQ(period(x % 4096), 4096);
  EXPECT_EQ(period(x % 4097), 0);
  EXPECT_EQ(period(x % 4096 + x % 4095), 0);
}

// The definition: e(x + period) - e(x) is the same for all x.
TEST(Periods, AreNoSmallerThanTheyMustBe) {
  for (int factor = -4; factor <= 6; ++factor) {
    for (int divisor = 1; divisor <= 12; ++divisor) {
      const auto quotient = [&](int v) {
        const int a = factor * v + 1, q = a / divisor;
        return a % divisor < 0 ? q - 1 : q;
      };
      const auto repeats = [&](int p) {
        for (int v = -30; v < 30; ++v) {
          if (quotient(v + p) - quotient(v) != quotient(p) - quotient(0)) return false;
        }
        return true;
      };
      int smallest = 1;
      while (!repeats(smallest)) ++smallest;
      const Expr e = binary(Kind::Div, x * factor + 1, make_const(Int(32), divisor));
      EXPECT_EQ(period(e), factor == 0 || divisor == 1 ? 1 : smallest)
          << factor << " / " << divisor;
    }
  }
}

TEST(Periods, GrowthIsTheSameEverywhere) {
  EXPECT_EQ(growth_over((x + 1) / 2 - 3, "x", 2), 1);
  EXPECT_EQ(growth_over((x + 1) % 2 + 6, "x", 2), 0);
  EXPECT_EQ(growth_over(3 * x, "x", 4), 12);
  EXPECT_EQ(growth_over(x / 2, "x", 3), std::nullopt);
  EXPECT_EQ(growth_over(x * x, "x", 2), std::nullopt);
  EXPECT_EQ(growth_over(Expr(7), "x", 5), 0);
}

}  // namespace
}  // namespace retrograde::analysis

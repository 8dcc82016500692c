// Tests interval analysis on random integer expressions over small boxes: every value that occurs lies in bounds_of,
// and a condition holds wherever solve_for claims it. A failure prints its seed.
#include <gtest/gtest.h>

#include <random>

#include "analysis/interval.h"
#include "analysis/linear.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::analysis {
namespace {

const std::vector<std::string> names = {"x", "y", "z"};

class RandomExpr {
 public:
  explicit RandomExpr(unsigned seed) : random_(seed) {}
  int number(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }

  Expr integer(int depth) {
    if (depth == 0)
      return number(0, 3) == 0 ? Expr(number(-9, 9)) : variable(names[number(0, 2)], Int(32));
    Expr a = integer(depth - 1), b = number(0, 2) == 0 ? integer(depth - 1) : integer(0);
    Expr c = number(1, 6);
    switch (number(0, 15)) {
      case 0:
        return a + b;
      case 1:
        return a - b;
      case 2:
        return a * number(-4, 4);
      case 3:
        return a * b;
      case 4:
        return a / c;
      case 5:
        return a % c;
      case 6:
        return a / -c;
      case 7:
        return a / b;
      case 8:
        return a % b;
      case 9:
        return min(a, b);
      case 10:
        return max(a, b);
      case 11:
        return clamp(a, -3, 4);
      case 12:
        return select(condition(depth - 1), a, b);
      case 13:
        return cast(Int(32), cast(number(0, 1) ? UInt(8) : Int(8), a));
      case 14:
        return cast(Int(32), call_op(Op::abs, UInt(32), {a}));
      default:
        return bits(a, b);
    }
  }
  Expr bits(const Expr& a, const Expr& b) {
    switch (number(0, 4)) {
      case 0:
        return call_op(Op::bitwise_and, {a, Expr(number(0, 12))});
      case 1:
        return call_op(Op::bitwise_or, {max(a, 0), max(b, 0)});
      case 2:
        return call_op(Op::shift_right, {a, Expr(number(0, 3))});
      case 3:
        return call_op(Op::shift_left, {a, Expr(number(0, 3))});
      default:
        return cast(Int(32), call_op(Op::absd, UInt(32), {a, b}));
    }
  }
  Expr condition(int depth) {
    Expr a = integer(depth), b = integer(0);
    switch (number(0, 7)) {
      case 0:
        return a < b;
      case 1:
        return a <= b;
      case 2:
        return a > b;
      case 3:
        return a >= b;
      case 4:
        return a == b;
      case 5:
        return a != b;
      case 6:
        return depth > 0 ? condition(depth - 1) && condition(depth - 1) : a < b;
      default:
        return depth > 0 ? condition(depth - 1) || !condition(depth - 1) : a <= b;
    }
  }

 private:
  std::mt19937 random_;
};

Substitution point(int x, int y, int z) { return {{"x", x}, {"y", y}, {"z", z}}; }

int64_t value_at(const Expr& e, const Substitution& at) {
  auto value = as_const_int(substitute(e, at));
  EXPECT_TRUE(value) << e;
  return value.value_or(0);
}

TEST(IntervalProperty, EveryValueLiesInsideItsBounds) {
  int bounded = 0;
  for (unsigned seed = 0; seed < 3000; ++seed) {
    RandomExpr random(seed);
    Expr e = random.integer(random.number(1, 4));
    int x0 = random.number(-6, 6), y0 = random.number(-6, 6), z0 = random.number(-2, 2);
    int x1 = x0 + random.number(0, 5), y1 = y0 + random.number(0, 5);
    Scope<Interval> scope;  // z is a symbol
    scope.push("x", {x0, x1});
    scope.push("y", {variable("z", Int(32)) + y0, variable("z", Int(32)) + y1});
    Interval v = bounds_of(e, scope);
    bounded += v.is_bounded();
    for (int x = x0; x <= x1; ++x) {
      for (int y = z0 + y0; y <= z0 + y1; ++y) {
        int64_t value = value_at(e, point(x, y, z0));
        if (v.min.defined()) {
          ASSERT_LE(value_at(v.min, point(0, 0, z0)), value) << "seed " << seed << ": " << e;
        }
        if (v.max.defined()) {
          ASSERT_GE(value_at(v.max, point(0, 0, z0)), value) << "seed " << seed << ": " << e;
        }
      }
    }
  }
  EXPECT_GT(bounded, 2900);
}

TEST(IntervalProperty, SolutionsHold) {
  int solved = 0;
  for (unsigned seed = 0; seed < 3000; ++seed) {
    RandomExpr random(seed);
    Expr condition = random.condition(random.number(0, 3));
    int y0 = random.number(-6, 6), y1 = y0 + random.number(0, 5), z = random.number(-3, 3);
    Scope<Interval> inner;
    inner.push("y", {y0, y1});
    auto solution = solve_for(condition, "x", inner);
    if (!solution) continue;
    if (solution->needed.defined() && value_at(solution->needed, point(0, 0, z)) == 0) continue;
    int64_t low = -12, high = 12;
    if (solution->interval.min.defined())
      low = std::max(low, value_at(solution->interval.min, point(0, 0, z)));
    if (solution->interval.max.defined())
      high = std::min(high, value_at(solution->interval.max, point(0, 0, z)));
    solved += low <= high;
    for (int64_t x = low; x <= high; ++x) {
      for (int y = y0; y <= y1; ++y) {
        ASSERT_EQ(value_at(condition, point(static_cast<int>(x), y, z)), 1)
            << "seed " << seed << ": " << condition << " at x=" << x << " y=" << y << " z=" << z;
      }
    }
  }
  EXPECT_GT(solved, 300);
}

}  // namespace
}  // namespace retrograde::analysis

// Selects with a costly arm (codegen/values/costly_arms.cpp) give the same bits as selecting between
// values that are computed everywhere. jit_test checks that there is a branch.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

namespace retrograde {
namespace {

constexpr int count = 96;
constexpr float infinity = std::numeric_limits<float>::infinity();

// Bases and exponents, ordinary and special.
Buffer<float> values(int step) {
  const float special[] = {0.0f, -0.0f, infinity, -infinity, NAN, 1e-40f, 3e38f, -2.0f};
  Buffer<float> result(count);
  for (int i = 0; i < count; ++i)
    result(i) = i % 5 == 0 ? special[i * step % 8] : static_cast<float>(i * step % 37) / 8 - 1;
  return result;
}

// The lanes that select the arm: none, all, every third, one, the second half.
const std::function<bool(int)> patterns[] = {
    [](int) { return false; }, [](int) { return true; }, [](int i) { return i % 3 == 0; },
    [](int i) { return i == 41; }, [](int i) { return i > count / 2; }};

void expect_same_bits(const Buffer<float>& a, const Buffer<float>& b, const std::string& what) {
  for (int i = 0; i < count; ++i) {
    const bool both_nan = std::isnan(a(i)) && std::isnan(b(i));
    EXPECT_TRUE(both_nan || std::memcmp(&a(i), &b(i), sizeof(float)) == 0)
        << what << " at " << i << ": " << a(i) << " and " << b(i);
  }
}

// `choose`(c, x, y, power, logarithm) is an expression that reads the two functions. It runs once
// inline, and once on stored values.
template <typename Choose>
void check_choice(const Choose& choose) {
  const Buffer<float> base = values(7), exponent = values(11);
  for (const auto& is_wanted : patterns) {
    Buffer<uint8_t> mask(count);
    for (int i = 0; i < count; ++i) mask(i) = is_wanted(i);
    for (int lanes : {1, 5, 8, 16}) {
      Var x("x");
      Func power("power"), logarithm("logarithm"), direct("direct"), stored("stored");
      power(x) = pow(base(x), exponent(x));
      logarithm(x) = log(base(x)) + atan2(base(x), exponent(x));
      const Expr c = mask(x) != 0;
      direct(x) = choose(c, base(x), exponent(x), pow(base(x), exponent(x)),
                         log(base(x)) + atan2(base(x), exponent(x)));
      stored(x) = choose(c, base(x), exponent(x), power(x), logarithm(x));
      for (Func& f : {std::ref(power), std::ref(logarithm)}) f.compute_root();
      if (lanes > 1) {
        for (Func& f : {std::ref(power), std::ref(logarithm), std::ref(direct), std::ref(stored)})
          f.vectorize(x, lanes, TailStrategy::GuardWithIf);
      }
      expect_same_bits(direct.realize({count}), stored.realize({count}), text(lanes, " lanes"));
    }
  }
}

TEST(CostlyArms, OfEitherSide) {
  check_choice([](const Expr& c, const Expr& x, const Expr&, const Expr& power, const Expr&) {
    return select(c, power, x);
  });
  check_choice([](const Expr& c, const Expr& x, const Expr&, const Expr& power, const Expr&) {
    return select(c, x, power);
  });
}

TEST(CostlyArms, OfBothSidesAndInsideOfEachOther) {
  check_choice([](const Expr& c, const Expr& x, const Expr& y, const Expr& power,
                  const Expr& logarithm) {
    return select(c, select(x < y, power, logarithm + y), select(y > 0.5f, x, logarithm * power));
  });
}

TEST(CostlyArms, ThatOthersReadToo) {
  check_choice(
      [](const Expr& c, const Expr& x, const Expr& y, const Expr& power, const Expr& logarithm) {
        return select(c, power, y) + select(x < y, logarithm, power - x) + power;
      });
}

}  // namespace
}  // namespace retrograde

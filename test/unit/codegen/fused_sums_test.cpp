// Tests that a sum of floats rounds by its expression alone, whatever else uses its products and whatever the loops are.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <cstring>
#include <random>

namespace retrograde {
namespace {

struct FusedSums : ::testing::Test {
  static constexpr int count = 256;

  static Buffer<float> numbers(unsigned seed) {
    Buffer<float> result(count);
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> pick(-1, 1);
    result.for_each_value([&](float& value) { value = pick(random); });
    return result;
  }

  static int different_elements(const Buffer<float>& a, const Buffer<float>& b) {
    int result = 0;
    for (int i = 0; i < count; ++i) result += std::memcmp(&a(i), &b(i), sizeof(float)) != 0;
    return result;
  }

  Buffer<float> alone(const Expr& value, int lanes = 16) {
    Func f("alone");
    f(x) = value;
    if (lanes > 1) f.vectorize(x, lanes);
    return f.realize({count});
  }
  // Where `product` is a result, too.
  Buffer<float> beside(const Expr& value, const Expr& product) {
    Func f("beside");
    f(x) = Tuple(value, product);
    f.vectorize(x, 16);
    return f.realize({count})[0];
  }

  const Var x{"x"};
  const Buffer<float> u = numbers(1), v = numbers(2), w = numbers(3);
  const Expr a = Buffer<float>(u)(x), b = Buffer<float>(v)(x), c = Buffer<float>(w)(x);
};

TEST_F(FusedSums, RoundAlikeWhereTheProductHasOtherUsers) {
  for (const Expr& sum : {a * b + c, c + a * b, a * b - c, c - a * b, a * b + c * c, lerp(c, b, a)})
    EXPECT_EQ(different_elements(alone(sum), beside(sum, a * b)), 0) << sum;
}

TEST_F(FusedSums, RoundAlikeInVectorsAndAlone) {
  Param<float> p("p"), q("q");
  p.set(0.3f);
  q.set(0.7f);
  for (const Expr& sum : {p * q + a, a - p * q, a * b + c, a / 8.0f + b, p / 4.0f - c}) {
    EXPECT_EQ(different_elements(alone(sum), alone(sum, 1)), 0) << sum;
    EXPECT_EQ(different_elements(alone(sum), beside(sum, p * q)), 0) << sum;
  }
}

TEST_F(FusedSums, OfEqualProductsAreZero) {
  const Buffer<float> difference = alone(a * b - b * a);
  for (int i = 0; i < count; ++i) EXPECT_EQ(difference(i), 0.0f) << i;
}

}  // namespace
}  // namespace retrograde

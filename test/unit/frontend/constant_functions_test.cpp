// Functions of constants give the same bits as at run time, and integers and conditions that depend
// on them are still constants.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cstring>
#include <random>
#include <vector>

#include "ir/build.h"
#include "support/variables.h"

namespace retrograde {
namespace {

struct Function {
  const char* name;
  Expr (*of)(const Expr&);
  double low, high;
};

void PrintTo(const Function& f, std::ostream* out) { *out << f.name; }

constexpr Function functions[] = {
    {"sin", [](const Expr& e) { return sin(e); }, -10, 10},
    {"cos", [](const Expr& e) { return cos(e); }, -10, 10},
    {"tan", [](const Expr& e) { return tan(e); }, -1.5, 1.5},
    {"exp", [](const Expr& e) { return exp(e); }, -9, 9},
    {"log", [](const Expr& e) { return log(e); }, 0.01, 20},
    {"asin", [](const Expr& e) { return asin(e); }, -1, 1},
    {"acos", [](const Expr& e) { return acos(e); }, -1, 1},
    {"atan", [](const Expr& e) { return atan(e); }, -5, 5},
    {"sinh", [](const Expr& e) { return sinh(e); }, -3, 3},
    {"cosh", [](const Expr& e) { return cosh(e); }, -3, 3},
    {"tanh", [](const Expr& e) { return tanh(e); }, -3, 3},
    {"asinh", [](const Expr& e) { return asinh(e); }, -3, 3},
    {"acosh", [](const Expr& e) { return acosh(e); }, 1, 9},
    {"atanh", [](const Expr& e) { return atanh(e); }, -0.9, 0.9},
    {"erf", [](const Expr& e) { return erf(e); }, -2, 2},
    {"pow", [](const Expr& e) { return pow(e, e * 0.5f); }, 0.1, 5},
    {"atan2", [](const Expr& e) { return atan2(e, 1.5f - e); }, -3, 3},
    {"hypot", [](const Expr& e) { return hypot(e, e + 1); }, -3, 3},
};

template <typename T>
Buffer<T> samples(const Function& f) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> between(f.low, f.high);
  Buffer<T> result(60);
  result.for_each_value([&](T& v) { v = static_cast<T>(between(random)); });
  for (int i = 0; i < 2; ++i) {  // cases where the result may be exact
    if (f.low <= i && i <= f.high) result(i) = static_cast<T>(i);
  }
  return result;
}

template <typename T>
void expect_same_bits(const Function& f) {
  const Buffer<T> in = samples<T>(f);
  Func late, early;
  late(x) = f.of(in(x));
  early(x) = cast<T>(Expr(0));
  for (int i = 0; i < in.width(); ++i) early(i) = f.of(Expr(in(i)));
  const Buffer<T> at_run_time = late.realize({in.width()}), folded = early.realize({in.width()});
  for (int i = 0; i < in.width(); ++i) {
    EXPECT_EQ(std::memcmp(&at_run_time(i), &folded(i), sizeof(T)), 0)
        << f.name << "(" << in(i) << ") = " << at_run_time(i) << " and " << folded(i);
  }
}

class ConstantFunctions : public ::testing::TestWithParam<Function> {};

TEST_P(ConstantFunctions, HaveTheBitsOfRunTime) {
  expect_same_bits<float>(GetParam());
  expect_same_bits<double>(GetParam());
}

INSTANTIATE_TEST_SUITE_P(Each, ConstantFunctions, ::testing::ValuesIn(functions));

TEST(ConstantFunctions, IntegersThatDependOnThemAreConstants) {
  EXPECT_EQ(ir::as_const_int(cast<int>(round(log(Expr(8.0f)) / log(Expr(2.0f))))), 3);
  EXPECT_EQ(ir::as_const_int(cast<int>(floor(10.0f * sin(Expr(0.5f))))), 4);
  EXPECT_TRUE(ir::is_const_true(exp(Expr(1.0)) > 2.5));
  EXPECT_TRUE(ir::is_const_false(cos(Expr(2.0f)) >= 0.0f));
}

TEST(ConstantFunctions, ExactOnesAreConstants) {
  EXPECT_TRUE(ir::is_one(cos(Expr(0.0f))));
  EXPECT_TRUE(ir::is_zero(log(Expr(1.0))));
}

}  // namespace
}  // namespace retrograde

// Tests that random expressions keep their value under simplification, for ordinary and for extreme inputs.
#include <gtest/gtest.h>

#include "ir/print.h"
#include "ir/visit.h"
#include "simplify/cse.h"
#include "simplify/facts.h"
#include "simplify/simplify.h"
#include "support/evaluate.h"
#include "support/random_ir.h"

namespace retrograde {
namespace {

using ir::Scalar;
using test::Evaluator;
using test::RandomIr;

enum class Inputs { Ordinary, Extreme };

Scalar random_value(RandomIr& random, Type type, Inputs inputs) {
  if (inputs == Inputs::Extreme && random.chance(40) && !type.is_float() && !type.is_bool()) {
    const int64_t offset = random.below(3);
    return Scalar::of_int(type, type.is_int() && random.chance(50) ? type.min_int() + offset
                                                                   : type.max_int() - offset);
  }
  return *ir::as_scalar(inputs == Inputs::Extreme ? random.constant(type)
                        : type.is_float() ? ir::make_const(type, (random.below(801) - 400) / 16.0)
                                          : ir::make_const(type, int64_t{random.below(60) - 20}));
}

std::map<std::string, Scalar> random_inputs(RandomIr& random, const Expr& e, Inputs inputs) {
  std::map<std::string, Scalar> values;
  ir::walk(e, [&](const ir::Variable& var) {
    values[var.name] = random_value(random, var.type, inputs);
  });
  return values;
}

std::string shown(const std::map<std::string, Scalar>& values) {
  std::string result;
  for (const auto& [name, value] : values)
    result += name + " = " + ir::print(ir::to_expr(value)) + "  ";
  return result;
}

// Compares the two at random points. Returns the number of comparisons, without those skipped for overflow.
int compare_at_points(RandomIr& random, const Expr& before, const Expr& after, Inputs inputs,
                      int points) {
  int compared = 0;
  for (int i = 0; i < points; ++i) {
    const std::map<std::string, Scalar> values = random_inputs(random, before, inputs);
    Evaluator old_values(values), new_values(values);
    const test::Lanes expected = old_values(before);
    if (old_values.overflowed()) continue;
    const test::Lanes actual = new_values(after);
    // Simplification may regroup sums. A regrouped sum may overflow although the original does not, but only if a part
    // is extreme.
    if (new_values.overflowed() && old_values.met_extreme()) continue;
    ++compared;
    EXPECT_EQ(expected.size(), actual.size());
    for (size_t lane = 0; lane < expected.size() && lane < actual.size(); ++lane) {
      EXPECT_TRUE(test::same_value(expected[lane], actual[lane]))
          << "before: " << before << "\nafter:  " << after << "\nat:     " << shown(values)
          << "\nlane " << lane << ": " << ir::to_expr(expected[lane]) << " became "
          << ir::to_expr(actual[lane]);
      if (testing::Test::HasFailure()) return compared;
    }
  }
  return compared;
}

void check_random(Type type, int depth, uint32_t first_seed, int count, Inputs inputs) {
  int compared = 0;
  for (uint32_t seed = first_seed; seed < first_seed + static_cast<uint32_t>(count); ++seed) {
    RandomIr random(seed);
    const Expr before = random.expr(type, depth);
    const Expr after = simplification::simplify(before);
    ASSERT_EQ(before.type(), after.type()) << before << "\n" << after;
    compared += compare_at_points(random, before, after, inputs, 12);
    ASSERT_FALSE(testing::Test::HasFailure()) << "seed " << seed;
  }
  EXPECT_GT(compared, count) << "too many points overflow for the test to mean anything";
}

TEST(SimplifyRandom, KeepsIndexExpressions) { check_random(Int(32), 5, 1, 6000, Inputs::Ordinary); }
TEST(SimplifyRandom, KeepsSmallIndexExpressions) {
  check_random(Int(32), 3, 100001, 12000, Inputs::Ordinary);
}
TEST(SimplifyRandom, KeepsIndexExpressionsAtExtremes) {
  check_random(Int(32), 3, 200001, 6000, Inputs::Extreme);
}
TEST(SimplifyRandom, KeepsConditions) { check_random(Bool(), 4, 300001, 8000, Inputs::Ordinary); }
TEST(SimplifyRandom, KeepsConditionsAtExtremes) {
  check_random(Bool(), 3, 400001, 4000, Inputs::Extreme);
}
TEST(SimplifyRandom, KeepsWideIntegers) { check_random(Int(64), 4, 500001, 3000, Inputs::Extreme); }
TEST(SimplifyRandom, KeepsFloatsBitForBit) {
  check_random(Float(32), 4, 600001, 4000, Inputs::Extreme);
}
TEST(SimplifyRandom, KeepsDoubles) { check_random(Float(64), 4, 700001, 2000, Inputs::Extreme); }
TEST(SimplifyRandom, KeepsHalves) {
  check_random(Float(16), 4, 800001, 1000, Inputs::Extreme);
  check_random(BFloat(16), 4, 810001, 1000, Inputs::Extreme);
}
TEST(SimplifyRandom, KeepsWrappingIntegers) {
  uint32_t seed = 900001;
  for (Type type : {UInt(8), UInt(16), UInt(32), UInt(64), Int(8), Int(16)}) {
    check_random(type, 4, seed, 1500, Inputs::Extreme);
    seed += 10000;
  }
}
TEST(SimplifyRandom, KeepsVectors) {
  check_random(Int(32, 4), 4, 1000001, 4000, Inputs::Ordinary);
  check_random(Bool(4), 4, 1100001, 3000, Inputs::Ordinary);
  check_random(Float(32, 4), 3, 1200001, 1000, Inputs::Extreme);
  check_random(UInt(8, 4), 4, 1300001, 1500, Inputs::Extreme);
}

// Both orders of minimum and maximum, with offsets, one-sided, and with empty ranges.
TEST(Simplify, DifferencesOfClampsKeepTheirValues) {
  std::vector<Expr> clamps;
  const Expr x = ir::variable("x");
  for (const int low : {-1, 0, 2}) {
    for (const int high : {-1, 1, 2}) {
      clamps.push_back(min(max(x, low), high));
      clamps.push_back(max(min(x + 1, high), low));
      clamps.push_back(max(min(x, high) - 1, low));
    }
    clamps.push_back(max(x, low));
    clamps.push_back(min(x - 1, low));
  }
  for (const Expr& a : clamps) {
    for (const Expr& b : clamps) {
      const Expr before = 2 * a - 2 * b, after = simplification::simplify(before);
      for (int at = -5; at <= 5; ++at) {
        const std::map<std::string, Scalar> values = {{"x", Scalar::of_int(Int(32), at)}};
        Evaluator old_values(values), new_values(values);
        ASSERT_TRUE(test::same_value(old_values(before)[0], new_values(after)[0]))
            << before << "\nafter: " << after << "\nat " << at;
      }
    }
  }
}

// Variables within specified bounds, some of them symbolic: y in [x, x + 9].
TEST(SimplifyRandom, KeepsExpressionsWithinGivenBounds) {
  const Expr x = ir::variable("x");
  const simplification::BoundsMap bounds = {
      {"x", {Expr(0), Expr(15)}}, {"y", {x, x + 9}}, {"z", {Expr(), Expr(4)}}};
  for (uint32_t seed = 1; seed <= 8000; ++seed) {
    RandomIr random(seed);
    const Expr before = random.expr(seed % 2 ? Bool() : Int(32), 3);
    const Expr after = simplification::simplify(before, bounds);
    for (int i = 0; i < 12; ++i) {
      std::map<std::string, Scalar> values = random_inputs(random, before, Inputs::Ordinary);
      const int at_x = random.below(16);
      values["x"] = Scalar::of_int(Int(32), at_x);
      values["y"] = Scalar::of_int(Int(32), at_x + random.below(10));
      values["z"] = Scalar::of_int(Int(32), 4 - random.below(100));
      Evaluator old_values(values), new_values(values);
      const Scalar expected = old_values(before)[0];
      const Scalar actual = new_values(after)[0];
      if (old_values.overflowed() || (new_values.overflowed() && old_values.met_extreme()))
        continue;
      ASSERT_TRUE(test::same_value(expected, actual))
          << "seed " << seed << "\nbefore: " << before << "\nafter:  " << after
          << "\nat:     " << shown(values);
    }
  }
}

Expr random_linear(RandomIr& random) {
  return simplification::simplify(ir::variable("x") * (random.below(9) - 4) +
                                  ir::variable("y") * (random.below(9) - 4));
}
// One end of a box of the last of several Funcs, each of which is read at quotients of the next one's coordinate, with
// borders now and then.
Expr random_end(RandomIr& random, Expr at, const std::vector<int>& divisors) {
  for (const int divisor : divisors) {
    at = (at + (random.below(40) - 20)) / divisor;
    if (random.chance(30)) {
      const Expr border = random_linear(random);
      at = random.chance(50) ? min(at, border) : max(at, border);
    }
  }
  return at;
}

// z runs over some values from a quotient on.
TEST(FactsRandom, DifferencesOfQuotientsStayBelowTheirBounds) {
  int bounded = 0;
  for (uint32_t seed = 0; seed < 4000; ++seed) {
    RandomIr random(seed);
    const Expr first = simplification::simplify(random_end(random, random_linear(random), {8}));
    const int extent = 1 + random.below(9);
    std::vector<int> divisors;
    for (int n = 1 + random.below(3); n > 0; --n) divisors.push_back(random.pick<int>({2, 3, 4}));
    const Expr at = random_linear(random) + ir::variable("z") * random.below(3);
    const Expr size = simplification::simplify(random_end(random, at, divisors) -
                                               random_end(random, at, divisors));
    simplification::Facts facts;
    facts.bind("z", first, simplification::simplify(first + (extent - 1)));
    const int64_t bound = facts.upper_bound_of_quotients(ir::sum_of(size));
    bounded += bound < 1000;
    for (int i = 0; i < 40; ++i) {
      std::map<std::string, Scalar> values;
      for (const char* name : {"x", "y"})
        values[name] = Scalar::of_int(Int(32), random.below(200) - 100);
      values["z"] = Scalar::of_int(Int(32), Evaluator(values)(first)[0].i + random.below(extent));
      ASSERT_LE(Evaluator(values)(size)[0].i, bound) << "seed " << seed << ": " << size << "\n"
                                                     << shown(values);
    }
  }
  EXPECT_GT(bounded, 2000);
}

TEST(SimplifyRandom, IsStable) {
  int changed = 0;
  for (uint32_t seed = 1; seed <= 2000; ++seed) {
    RandomIr random(seed);
    const Expr once = simplification::simplify(random.expr(Int(32), 3));
    changed += !simplification::simplify(once).same_as(once);
  }
  EXPECT_LT(changed, 100) << "of 2000 expressions simplify further the second time";
}

TEST(CseRandom, LetsAndSharingMeanTheSame) {
  for (uint32_t seed = 1; seed <= 3000; ++seed) {
    RandomIr random(seed);
    const Expr before = random.expr(seed % 3 ? Int(32) : Float(32), 5);
    compare_at_points(random, before, simplification::introduce_lets(before), Inputs::Ordinary, 3);
    compare_at_points(random, before, simplification::expand_lets(before), Inputs::Ordinary, 3);
    ASSERT_FALSE(testing::Test::HasFailure()) << "seed " << seed;
  }
}

}  // namespace
}  // namespace retrograde

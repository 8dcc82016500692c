// The table of operators: complete in every column, and each column consistent with the values.
#include "ir/operators.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "diagnostics/error.h"
#include "ir/scalar.h"

namespace retrograde::ir {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
using Table = std::vector<OpInfo>;

Table table() {
  Table rows;
  for (int i = 0; i < op_count; ++i) rows.push_back(op_info(static_cast<Op>(i)));
  return rows;
}

// "operator: column" for each omission of a table.
std::vector<std::string> left_out(const Table& rows) {
  std::vector<std::string> result;
  for (const OpInfo& row : rows) {
    if (const char* column = unstated_column(row))
      result.push_back(std::string(row.name) + ": " + column);
  }
  return result;
}

TEST(Operators, EveryColumnOfEveryOperatorIsStated) {
  EXPECT_EQ(left_out(table()), std::vector<std::string>());
}

TEST(Operators, AnOperatorThatIsAddedWithoutAColumnIsFound) {
  const std::pair<const char*, std::function<void(OpInfo&)>> columns[] = {
      {"arity", [](OpInfo& row) { row.arity = OpInfo{}.arity; }},
      {"class", [](OpInfo& row) { row.cls = {}; }},
      {"value", [](OpInfo& row) { row.value = {}; }},
      {"bounds", [](OpInfo& row) { row.bounds = {}; }},
      {"values", [](OpInfo& row) { row.values = {}; }},
      {"monotone", [](OpInfo& row) { row.real.monotone = {}; }},
      {"infinite", [](OpInfo& row) { row.real.infinite = {}; }},
      {"nan", [](OpInfo& row) { row.real.nan = {}; }},
      {"levels", [](OpInfo& row) { row.real.levels = {}; }},
      {"poles", [](OpInfo& row) { row.real.poles = {}; }},
      {"error", [](OpInfo& row) { row.real.error = {}; }},
      {"work", [](OpInfo& row) { row.work = {}; }},
      {"conduct", [](OpInfo& row) { row.conduct = {}; }},
  };
  OpInfo cbrt = op_info(Op::sqrt);
  cbrt.name = "cbrt";
  Table rows = table();
  rows.push_back(cbrt);
  ASSERT_EQ(left_out(rows), std::vector<std::string>());
  for (const auto& [column, leave_out] : columns) {
    rows.back() = cbrt;
    leave_out(rows.back());
    EXPECT_EQ(left_out(rows), std::vector<std::string>{std::string("cbrt: ") + column});
  }
}

TEST(Operators, ColumnsAgreeWithEachOther) {
  for (const OpInfo& row : table()) {
    const RealFacts& real = row.real;
    const bool is_exact = real.error.kind == OpError::Kind::Exact;
    if (row.bounds == BoundsRule::AtEnds) {
      EXPECT_TRUE(real.monotone == Monotone::Rises && is_exact && row.arity == 1) << row.name;
    }
    if (row.bounds == BoundsRule::Within) {
      EXPECT_TRUE(std::isfinite(row.values.low) || std::isfinite(row.values.high)) << row.name;
    }
    if (real.error.kind == OpError::Kind::Library) {
      EXPECT_TRUE(real.error.ulp_float32 >= 0.5 && real.error.ulp_float64 >= 0.5 &&
                  real.error.ulp_elsewhere >= real.error.ulp_float64)
          << row.name;
    }
    if (const Op of = real.error.of; of != Op::none) {
      EXPECT_EQ(op_info(of).real.error.kind, OpError::Kind::Library) << row.name;
    }
  }
}

// ---- the columns of real functions against their values ----

const std::vector<double> samples = {-inf, -1e300,  -1e10, -800,   -10, -2.5, -1,
                                     -0.5, -1e-300, 0,     1e-300, 0.5, 1,    2.5,
                                     10,   800,     1e10,  1e300,  inf};

bool takes_numbers(const OpInfo& row) {
  return row.cls == OpClass::Pure && row.work.adds + row.work.mults + row.work.functions > 0;
}

struct Point {
  std::vector<double> operands;
  double value;
  bool is_finite;  // all operands
};

double value_of(const OpInfo& row, const std::vector<double>& operands) {
  std::vector<Scalar> args;
  for (double operand : operands) args.push_back(Scalar::of_float(Float(64), operand));
  args.resize(3);
  return row.value(args[0], args[1], args[2], Float(64)).as_double();
}

std::vector<Point> points(const OpInfo& row) {
  std::vector<Point> result;
  const auto add = [&](const std::vector<double>& operands) {
    bool is_finite = true;
    for (double operand : operands) is_finite &= std::isfinite(operand);
    result.push_back({operands, value_of(row, operands), is_finite});
  };
  for (double x : samples) {
    if (row.arity == 1) add({x});
    for (double y : samples) {
      if (row.arity == 2) add({x, y});
      for (double weight : {0.0, 0.25, 1.0}) {
        if (row.arity == 3) add({x, y, weight});
      }
    }
  }
  return result;
}

TEST(Operators, NumbersLieWithinTheValuesThatTheTableSays) {
  for (const OpInfo& row : table()) {
    if (!takes_numbers(row)) continue;
    for (const Point& p : points(row))
      EXPECT_FALSE(p.value < row.values.low || p.value > row.values.high) << row.name << p.value;
  }
}

TEST(Operators, NanComesWhereTheTableSays) {
  for (const OpInfo& row : table()) {
    if (!takes_numbers(row)) continue;
    bool outside = false, at_infinity = false;
    for (const Point& p : points(row)) {
      if (std::isnan(p.value)) (p.is_finite ? outside : at_infinity) = true;
    }
    EXPECT_EQ(outside, row.real.nan == Nan::NanOutside) << row.name;
    if (!outside) {
      EXPECT_EQ(at_infinity, row.real.nan == Nan::NanAtInfinity) << row.name;
    }
  }
}

TEST(Operators, InfinityComesWhereTheTableSays) {
  for (const OpInfo& row : table()) {
    if (!takes_numbers(row)) continue;
    bool infinite = false, early = false;  // where a product of the operands would not be
    for (const Point& p : points(row)) {
      infinite |= p.is_finite && std::isinf(p.value);
      bool is_small = true;
      for (double operand : p.operands) is_small &= std::abs(operand) <= 1e10;
      early |= is_small && std::isinf(p.value);
    }
    const Infinite stated = row.real.infinite;
    EXPECT_FALSE(infinite && stated == Infinite::StaysFinite) << row.name;
    // No float64 is a pole of the tangent; the partial of a strong product may be one.
    const std::string name = row.name;
    if (name == "tan" || name == "strong_mul") continue;
    EXPECT_EQ(early, stated == Infinite::Explodes || stated == Infinite::Somewhere) << name;
  }
}

TEST(Operators, ValuesRiseAndFallAsTheTableSays) {
  for (const OpInfo& row : table()) {
    if (!takes_numbers(row) || row.arity != 1) continue;
    bool rises = false, falls = false;
    const Point* last = nullptr;
    const std::vector<Point> all = points(row);
    for (const Point& p : all) {
      if (std::isnan(p.value)) continue;
      rises |= last && p.value > last->value;
      falls |= last && p.value < last->value;
      last = &p;
    }
    EXPECT_FALSE(falls && row.real.monotone == Monotone::Rises) << row.name;
    EXPECT_FALSE(rises && row.real.monotone == Monotone::Falls) << row.name;
  }
}

TEST(Operators, AnOperatorThatNobodyKnowsHasNoScalarMeaning) {
  EXPECT_FALSE(eval_operator(Op::none, {Scalar()}, Float(32)).has_value());
  EXPECT_THROW(op_info(Op::random).value({}, {}, {}, Float(32)), InternalError);
}

}  // namespace
}  // namespace retrograde::ir

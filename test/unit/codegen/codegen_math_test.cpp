// Vector math compared with the errors that math_table.h promises, in every width. Also checks that
// a function's bits do not depend on the width.
#include <algorithm>

#include "codegen/math/math_table.h"
#include "ir/text.h"
#include "support/reference_functions.h"
#include "unit/codegen/codegen_testing.h"

namespace retrograde::testing_codegen {
namespace {

using codegen::MathFunction;

constexpr int count = 4096;

// ---- samples ----

// Every magnitude, the neighbourhood of 0 and 1, and the special values.
template <typename Number>
std::vector<Number> samples(uint32_t seed) {
  using Limits = std::numeric_limits<Number>;
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Number> values = {0,
                                -0.0,
                                1,
                                -1,
                                Limits::infinity(),
                                -Limits::infinity(),
                                Limits::quiet_NaN(),
                                Limits::denorm_min(),
                                Limits::min(),
                                Limits::max(),
                                -Limits::max(),
                                0.5,
                                2,
                                3,
                                -2,
                                Number(88.7),
                                Number(89.3),
                                Number(-89.3),
                                Number(710),
                                Number(-103.5),
                                Number(0.999999)};
  while (values.size() < count) {
    const double u = unit(engine);
    switch (engine() % 5) {
      case 0:
        values.push_back(static_cast<Number>(u));
        break;
      case 1:
        values.push_back(static_cast<Number>(1 + u * 0.01));
        break;
      case 2:
        values.push_back(static_cast<Number>(u * 100));
        break;
      case 3:
        values.push_back(static_cast<Number>(u * 1e5));
        break;
      default:
        values.push_back(static_cast<Number>(
            std::ldexp(u, static_cast<int>(engine() % 2000) % (Limits::max_exponent * 2) -
                              Limits::max_exponent)));
    }
  }
  return values;
}

int arity_of(Op op) { return op_info(op).arity; }

LoweredFunction apply(Op op, Type type, int lanes) {
  LoweredFunction f;
  f.name = op_info(op).name;
  const Expr index = lanes_at(variable("i") * lanes, lanes);
  std::vector<Expr> args;
  for (int k = 0; k < arity_of(op); k++) {
    f.args.push_back(input("in" + std::to_string(k), type));
    args.push_back(make_load(type.with_lanes(lanes), "in" + std::to_string(k), index));
  }
  f.args.push_back(output("out", type));
  f.body = make_for("i", 0, count / lanes, ForType::Serial,
                    make_store("out", call_op(op, type.with_lanes(lanes), args), index));
  return f;
}

template <typename Number>
std::vector<Number> run(Op op, int lanes, const std::vector<Number>& x,
                        const std::vector<Number>& y, const Target& target = test_target()) {
  const Type type = type_of<Number>();
  Array a(type, count), b(type, count), out(type, count);
  std::copy_n(x.begin(), count, a.data<Number>());
  std::copy_n(y.begin(), count, b.data<Number>());
  std::vector<Array*> arrays = {&a, &b, &out};
  if (arity_of(op) == 1) arrays.erase(arrays.begin() + 1);
  EXPECT_EQ(call(apply(op, type, lanes), arrays, nullptr, target), 0);
  return {out.data<Number>(), out.data<Number>() + count};
}

template <typename Number>
void check_errors(const MathFunction& function, double limit) {
  const auto x = samples<Number>(1), y = samples<Number>(2);
  const auto got = run(function.op, 1, x, y);
  for (size_t i = 0; i < count; i++) {
    const long double exact = reference_value(function.op, x[i], y[i]);
    ASSERT_LE(error_in_ulp(got[i], exact), limit)
        << op_info(function.op).name << "(" << x[i] << ", " << y[i] << ") = " << got[i]
        << ", exactly " << exact;
  }
}

template <typename Number>
void check_widths(Op op, const std::vector<int>& widths, const Target& target) {
  const auto x = samples<Number>(3), y = samples<Number>(4);
  const auto scalar = run(op, 1, x, y, target);
  for (int lanes : widths) {
    const auto vector = run(op, lanes, x, y, target);
    const int whole = count / lanes * lanes;
    for (int i = 0; i < whole; i++) {
      const auto at = static_cast<size_t>(i);
      ASSERT_TRUE(same(Scalar::of_float(type_of<Number>(), scalar[at]),
                       Scalar::of_float(type_of<Number>(), vector[at])))
          << op_info(op).name << "(" << x[at] << ", " << y[at] << "): " << vector[at] << " in "
          << lanes << " lanes, alone " << scalar[at];
    }
  }
}

TEST(CodegenMath, ErrorsOfFloat32AreAsTheTableSays) {
  for (const MathFunction& function : codegen::math_functions) {
    check_errors<float>(function, op_info(function.op).real.error.ulp_float32);
  }
}

TEST(CodegenMath, ErrorsOfFloat64AreAsTheTableSays) {
  for (const MathFunction& function : codegen::math_functions) {
    check_errors<double>(function, op_info(function.op).real.error.ulp_float64);
  }
}

TEST(CodegenMath, BitsDoNotDependOnTheWidth) {
  for (const MathFunction& function : codegen::math_functions) {
    check_widths<float>(function.op, {3, 4, 8, 16, 20}, test_target());
    check_widths<double>(function.op, {2, 5, 8}, test_target());
  }
  if (test_target().arch != Target::X86) return;
  for (const MathFunction& function : codegen::math_functions) {
    check_widths<float>(function.op, {4, 6}, Target("x86-64-linux"));
    check_widths<float>(function.op, {8}, Target("x86-64-linux-sse41-avx"));
  }
}

TEST(CodegenMath, PowOfEveryPairOfSpecialValuesFollowsC99) {
  const float infinity = std::numeric_limits<float>::infinity(),
              nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> special = {0,        1,        2,          3,      0.5f,
                                2.5f,     1e-30f,   1e5f,       1e-45f, 0.999f,
                                16777215, 16777216, 8388607.5f, 3e38f,  infinity};
  for (size_t i = 0, n = special.size(); i < n; i++) special.push_back(-special[i]);
  special.push_back(nan);
  std::vector<float> x(count, 1.0f), y(count, 1.0f);
  for (size_t i = 0; i < special.size() * special.size(); i++) {
    x[i] = special[i / special.size()];
    y[i] = special[i % special.size()];
  }
  const auto got = run(Op::pow, 8, x, y);
  for (size_t i = 0; i < special.size() * special.size(); i++) {
    const double exact = std::pow(static_cast<double>(x[i]), static_cast<double>(y[i]));
    ASSERT_LE(error_in_ulp(got[i], exact), 0.55)
        << "pow(" << x[i] << ", " << y[i] << ") = " << got[i] << ", exactly " << exact;
    if (!std::isnan(exact)) {
      ASSERT_EQ(std::signbit(got[i]), std::signbit(exact)) << "pow(" << x[i] << ", " << y[i] << ")";
    }
  }
}

// Exponents of all sizes, with bases whose powers are ordinary, denormal, 0 or infinite, narrowly
// or by far.
TEST(CodegenMath, PowersThatOverflowOrVanishDoSoAtAnyScale) {
  std::vector<float> x, y;
  for (int scale = -60; scale <= 60; scale += 2) {
    for (const double digits : {-1.9, -1.37, 1.0, 1.46}) {
      for (const double log2 : {0.3, 100.0, 127.9, 128.1, 140.0, 148.8, 151.0, 280.0, 400.0, 420.0,
                                577.0, 600.0, 1100.0, 5000.0}) {
        const float exponent = static_cast<float>(std::ldexp(digits, scale));
        x.push_back(static_cast<float>(std::exp2(log2 / exponent)));
        y.push_back(x.size() % 2 ? exponent : -exponent);
      }
    }
  }
  x.resize(count, 1.0f);
  y.resize(count, 0.0f);
  std::vector<Target> targets = {test_target()};
  if (test_target().arch == Target::X86) targets.push_back(Target("x86-64-linux"));
  for (const Target& target : targets) {
    const auto got = run(Op::pow, 8, x, y, target);
    for (size_t i = 0; i < x.size(); i++) {
      const double exact = std::pow(static_cast<double>(x[i]), static_cast<double>(y[i]));
      ASSERT_LE(error_in_ulp(got[i], exact), 0.55)
          << "pow(" << x[i] << ", " << y[i] << ") = " << got[i] << ", exactly " << exact;
    }
  }
}

// All lanes of argument `uniform` hold the first lane's number.
std::vector<float> pow_with_uniform(int uniform, int lanes, const std::vector<float>& x,
                                    const std::vector<float>& y) {
  LoweredFunction f;
  f.name = "pow";
  const Expr start = variable("i") * lanes, index = lanes_at(start, lanes);
  const auto operand = [&](int k, const char* name) {
    return k == uniform ? make_broadcast(make_load(Float(32), name, start), lanes)
                        : make_load(Float(32, lanes), name, index);
  };
  f.args = {input("x", Float(32)), input("y", Float(32)), output("out", Float(32))};
  f.body = make_for(
      "i", 0, count / lanes, ForType::Serial,
      make_store("out", call_op(Op::pow, Float(32, lanes), {operand(0, "x"), operand(1, "y")}),
                 index));
  Array a(Float(32), count), b(Float(32), count), out(Float(32), count);
  std::copy_n(x.begin(), count, a.data<float>());
  std::copy_n(y.begin(), count, b.data<float>());
  EXPECT_EQ(call(f, {&a, &b, &out}), 0);
  return {out.data<float>(), out.data<float>() + count};
}

TEST(CodegenMath, PowsBitsDoNotDependOnWhichArgumentIsUniform) {
  for (const int lanes : {4, 32}) {
    for (const int uniform : {0, 1}) {
      auto x = samples<float>(11), y = samples<float>(12);
      for (size_t i = 0, n = static_cast<size_t>(lanes); i < count; i++)
        (uniform == 0 ? x : y)[i] = (uniform == 0 ? x : y)[i / n * n];
      const auto expected = run(Op::pow, lanes, x, y), got = pow_with_uniform(uniform, lanes, x, y);
      for (size_t i = 0; i < count; i++) {
        ASSERT_TRUE(
            same(Scalar::of_float(Float(32), expected[i]), Scalar::of_float(Float(32), got[i])))
            << "pow(" << x[i] << ", " << y[i] << "): " << expected[i] << ", with argument "
            << uniform << " uniform " << got[i];
      }
    }
  }
}

// The function applied to constants that only code generation evaluates, as vectors and scalars.
template <typename Number>
void check_constants(Op op, const Target& target) {
  constexpr size_t values = 48;
  const auto x = samples<Number>(6), y = samples<Number>(7);
  const auto expected = run(op, 1, x, y, target);
  const Type type = type_of<Number>();
  LoweredFunction f;
  f.name = op_info(op).name;
  f.args = {output("out", type)};
  std::vector<Stmt> stores;
  for (size_t i = 0; i < values; i++) {
    const int lanes = i % 2 ? 4 : 1;
    std::vector<Expr> args;
    for (int k = 0; k < arity_of(op); k++) {
      // Otherwise the IR's builders would fold it.
      const Expr named = variable(text("c", i, ".", k), type);
      args.push_back(lanes == 1 ? named : make_broadcast(named, lanes));
    }
    Stmt store = make_store("out", call_op(op, type.with_lanes(lanes), args),
                            lanes_at(static_cast<int>(i), lanes));
    for (int k = 0; k < arity_of(op); k++) {
      const double number = static_cast<double>(k == 0 ? x[i] : y[i]);
      store = make_let(text("c", i, ".", k), make_const(type, number), store);
    }
    stores.push_back(store);
  }
  f.body = make_block(stores);
  Array out(type, values + 4);
  ASSERT_EQ(call(f, {&out}, nullptr, target), 0);
  for (size_t i = 0; i < values; i++) {
    ASSERT_TRUE(same(Scalar::of_float(type, expected[i]), out.get(i)))
        << op_info(op).name << "(" << x[i] << ", " << y[i] << ") = " << expected[i]
        << " at run time, " << show(out.get(i)) << " when it was compiled";
  }
}

TEST(CodegenMath, ConstantsGiveTheBitsOfTheRunTimeFunction) {
  for (const MathFunction& function : codegen::math_functions) {
    check_constants<float>(function.op, test_target());
    check_constants<double>(function.op, test_target());
    if (test_target().arch == Target::X86)
      check_constants<float>(function.op, Target("x86-64-linux"));
  }
}

TEST(CodegenMath, EveryOperatorHasCode) {
  // Totality: an operator that is neither simple nor in a table would throw. Effect and Internal
  // operators have tests of their own.
  for (int i = 0; i < op_count; i++) {
    const Op op = static_cast<Op>(i);
    const OpInfo& info = op_info(op);
    if (info.cls != OpClass::Pure && info.cls != OpClass::Marker) continue;
    const bool is_bitwise = op <= Op::shift_right || op == Op::popcount ||
                            op == Op::count_leading_zeros || op == Op::count_trailing_zeros;
    const Type type = is_bitwise ? Int(32) : Float(32);
    const bool is_test = op == Op::is_nan || op == Op::is_inf || op == Op::is_finite;
    LoweredFunction f;
    f.name = info.name;
    f.args = {input("in", type), output("out", is_test ? Bool() : type)};
    std::vector<Expr> args;
    for (int k = 0; k < (info.arity < 0 ? 1 : info.arity); k++)
      args.push_back(make_load(type, "in", k));
    f.body = make_store("out", call_op(op, is_test ? Bool() : type, args), 0);
    EXPECT_NO_THROW(compile_test(f)) << info.name;
  }
}

TEST(CodegenMath, AnOperatorWithoutCodeIsRefused) {
  LoweredFunction f;
  f.name = "added";
  f.args = {input("in", Float(32)), output("out", Float(32))};
  const Expr added(make_node<Call>(Float(32), CallType::Operator, Op::none, "added",
                                   std::vector<Expr>{make_load(Float(32), "in", 0)}, 0,
                                   SymbolRef()));
  f.body = make_store("out", added, 0);
  EXPECT_THROW(compile_test(f), InternalError);
}

TEST(CodegenMath, TablesOfFunctionsHoldTheOperatorsWhoseRowsSaySo) {
  const auto holds = [](const auto& functions, Op op) {
    return std::any_of(std::begin(functions), std::end(functions),
                       [&](const auto& function) { return function.op == op; });
  };
  for (int i = 0; i < op_count; i++) {
    const Op op = static_cast<Op>(i);
    const OpError::Kind kind = op_info(op).real.error.kind;
    EXPECT_EQ(holds(codegen::math_functions, op), kind == OpError::Kind::Library)
        << op_info(op).name;
    EXPECT_EQ(holds(codegen::fast_functions, op), kind == OpError::Kind::Approximates)
        << op_info(op).name;
  }
}

TEST(CodegenMath, FastFormsKeepTheirErrors) {
  for (const auto& function : codegen::fast_functions) {
    std::mt19937 engine(5);
    std::vector<float> x(count), y(count);
    const bool is_logarithmic = function.low > 0;
    for (size_t i = 0; i < count; i++) {
      const double u = std::uniform_real_distribution<double>(0, 1)(engine);
      x[i] = static_cast<float>(is_logarithmic
                                    ? function.low * std::pow(function.high / function.low, u)
                                    : function.low + u * (function.high - function.low));
      if (i % 4 == 0 && is_logarithmic) x[i] = static_cast<float>(1 + (u - 0.5) * 0.2);
      const double v = std::uniform_real_distribution<double>(-8, 8)(engine);
      y[i] = static_cast<float>(v / std::max(1.0, std::fabs(std::log(static_cast<double>(x[i])))));
    }
    for (int lanes : {1, 16}) {
      const auto got = run(function.op, lanes, x, y);
      for (size_t i = 0; i < count; i++) {
        const long double exact = reference_value(function.op, x[i], y[i]);
        const long double error = std::fabs(got[i] - exact);
        ASSERT_TRUE(error <= function.max_relative_error * std::fabs(exact) ||
                    error <= function.max_absolute_error)
            << op_info(function.op).name << "(" << x[i] << ", " << y[i] << ") = " << got[i]
            << ", exactly " << exact << ", relative error " << error / std::fabs(exact);
      }
    }
  }
}

TEST(CodegenMath, FastFormsAtSpecialValues) {
  const float infinity = std::numeric_limits<float>::infinity(),
              nan = std::numeric_limits<float>::quiet_NaN();
  const auto at = [&](Op op, float x, float y = 0) {
    return run(op, 8, std::vector<float>(count, x), std::vector<float>(count, y))[0];
  };
  for (const auto& function : codegen::fast_functions) {
    if (function.op != Op::fast_pow) {
      EXPECT_TRUE(std::isnan(at(function.op, nan))) << op_info(function.op).name;
    }
  }
  EXPECT_EQ(at(Op::fast_log, 0), -infinity);
  EXPECT_EQ(at(Op::fast_log, infinity), infinity);
  EXPECT_TRUE(std::isnan(at(Op::fast_log, -1)));
  EXPECT_GT(at(Op::fast_exp, 1000), 1e38f);
  EXPECT_LT(at(Op::fast_exp, -1000), 1e-37f);
  EXPECT_EQ(at(Op::fast_pow, 0, 0), 1);
  EXPECT_EQ(at(Op::fast_pow, 0, 2), 0);
  EXPECT_EQ(at(Op::fast_inverse, 0), infinity);
  EXPECT_EQ(at(Op::fast_inverse_sqrt, 0), infinity);
  EXPECT_EQ(at(Op::fast_inverse_sqrt, infinity), 0);
  EXPECT_TRUE(std::isnan(at(Op::fast_inverse_sqrt, -1)));
}

TEST(CodegenMath, HalvesRoundTheFloat32Result) {
  for (Type type : {Float(16), BFloat(16)}) {
    Array in(type, 64), out(type, 64);
    for (size_t i = 0; i < 64; i++) in.set(i, Scalar::of_float(type, static_cast<double>(i) / 8));
    LoweredFunction f;
    f.name = "half_exp";
    f.args = {input("in", type), output("out", type)};
    const Expr index = make_ramp(variable("i") * 16, 1, 16);
    f.body = make_for(
        "i", 0, 4, ForType::Serial,
        make_store("out", call_op(Op::exp, {make_load(type.with_lanes(16), "in", index)}), index));
    ASSERT_EQ(call(f, {&in, &out}), 0);
    for (size_t i = 0; i < 64; i++) {
      const Scalar exact = *eval_operator(Op::exp, {in.get(i)}, type);
      const double unit = std::fabs(exact.f) * std::ldexp(1.0, type.is_bfloat() ? -7 : -10);
      EXPECT_NEAR(out.get(i).f, exact.f, unit) << show(in.get(i));
    }
  }
}

}  // namespace
}  // namespace retrograde::testing_codegen

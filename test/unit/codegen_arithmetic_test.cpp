// Machine code of arithmetic against the one definition of scalars, on random and extreme operands, in every type and
// in widths that fit the machine's vectors and widths that do not.
#include "unit/codegen_testing.h"

namespace retrograde::testing_codegen {
namespace {

const int widths[] = {1, 2, 3, 4, 5, 8, 12, 16, 20};

const Type number_types[] = {Int(8),    Int(16),   Int(32),   Int(64),   UInt(8),   UInt(16),
                             UInt(32),  UInt(64),  Float(16), BFloat(16), Float(32), Float(64)};

// out[i] = make(a[i], b[i] ...) for i in [0, count), `lanes` at a time.
using Make = std::function<Expr(const std::vector<Expr> &)>;
LoweredFunction elementwise(const std::vector<Type> &inputs, Type result, int lanes, int count, const Make &make) {
  LoweredFunction function;
  function.name = "elementwise";
  const Expr index = variable("i") * lanes;
  std::vector<Expr> operands;
  for (size_t k = 0; k < inputs.size(); k++) {
    const std::string name = "in" + std::to_string(k);
    function.args.push_back(input(name, inputs[k]));
    operands.push_back(make_load(inputs[k].with_lanes(lanes), name, lanes_at(index, lanes)));
  }
  function.args.push_back(output("out", result));
  const Stmt store = make_store("out", make(operands), lanes_at(index, lanes));
  function.body = make_for("i", 0, count / lanes, ForType::Serial, store);
  return function;
}

using Oracle = std::function<Scalar(const std::vector<Scalar> &)>;
void check(const std::string &what, const std::vector<Type> &inputs, Type result, int lanes, const Make &make,
           const Oracle &oracle, const Target &target = test_target()) {
  const int count = 240;  // divisible by all widths
  RandomScalars random(static_cast<uint32_t>(lanes));
  std::vector<std::unique_ptr<Array>> arrays;
  for (Type type : inputs) {
    arrays.push_back(std::make_unique<Array>(type, count));
    for (size_t i = 0; i < count; i++) arrays.back()->set(i, random(type));
  }
  arrays.push_back(std::make_unique<Array>(result, count));
  std::vector<Array *> raw;
  for (auto &array : arrays) raw.push_back(array.get());
  ASSERT_EQ(call(elementwise(inputs, result, lanes, count, make), raw, nullptr, target), 0) << what;
  for (size_t i = 0; i < count; i++) {
    std::vector<Scalar> operands;
    std::string text;
    for (size_t k = 0; k < inputs.size(); k++) {
      operands.push_back(arrays[k]->get(i));
      text += " " + show(operands.back());
    }
    const Scalar expected = oracle(operands), got = arrays.back()->get(i);
    ASSERT_TRUE(same(expected, got)) << what << " of" << text << " in " << lanes << " lanes: " << show(got)
                                     << ", expected " << show(expected);
  }
}

void check_binary(Kind kind, Type type, int lanes, const Target &target = test_target()) {
  const bool compares = kind >= Kind::EQ && kind <= Kind::GE;
  check(
      kind_name(kind), {type, type}, compares ? Bool() : type, lanes,
      [&](const std::vector<Expr> &args) { return binary(kind, args[0], args[1]); },
      [&](const std::vector<Scalar> &args) { return eval_binary(kind, args[0], args[1]); }, target);
}

TEST(CodegenArithmetic, BinaryOperatorsInEveryTypeAndWidth) {
  for (int lanes : widths) {
    for (Type type : number_types) {
      for (int kind = static_cast<int>(Kind::Add); kind <= static_cast<int>(Kind::GE); kind++) {
        check_binary(static_cast<Kind>(kind), type, lanes);
      }
    }
  }
}

// Processors of several ages, all of which this one can stand in for.
std::vector<Target> older_targets() {
  std::vector<Target> targets;
  const Target host = get_host_target();
  if (host.arch != Target::X86) return targets;
  for (const char *text : {"x86-64-linux", "x86-64-linux-sse41-avx", "x86-64-linux-sse41-avx-f16c-fma-avx2"}) {
    const Target target(text);
    bool runs = true;
    for (int f = 0; f < Target::FeatureEnd; f++) {
      const auto feature = static_cast<Target::Feature>(f);
      runs = runs && (!target.has_feature(feature) || host.has_feature(feature));
    }
    if (runs) targets.push_back(target);
  }
  return targets;
}

TEST(CodegenArithmetic, BinaryOperatorsOnOlderProcessors) {
  for (const Target &target : older_targets()) {
    for (int lanes : {1, 8, 12}) {
      for (Type type : number_types) {
        for (Kind kind : {Kind::Add, Kind::Mul, Kind::Div, Kind::Mod, Kind::Min, Kind::Max, Kind::LT}) {
          check_binary(kind, type, lanes, target);
        }
      }
    }
  }
}

TEST(CodegenArithmetic, BooleansAndSelect) {
  for (int lanes : widths) {
    for (Kind kind : {Kind::And, Kind::Or, Kind::EQ, Kind::NE}) check_binary(kind, Bool(), lanes);
    check(
        "not", {Bool()}, Bool(), lanes, [](const auto &args) { return logical_not(args[0]); },
        [](const auto &args) { return eval_not(args[0]); });
    for (Type type : {Int(16), Float(16), Float(32), Bool()}) {
      check(
          "select", {Bool(), type, type}, type, lanes,
          [](const auto &args) { return make_select(args[0], args[1], args[2]); },
          [](const auto &args) { return args[0].as_bool() ? args[1] : args[2]; });
    }
  }
}

TEST(CodegenArithmetic, DivisionByConstants) {
  for (Type type : {Int(8), Int(16), Int(32), Int(64), UInt(8), UInt(16), UInt(32), UInt(64)}) {
    std::vector<int64_t> divisors = {0, 1, 2, 3, 5, 7, 8, 10, 64, 100, 127};
    if (type.is_int()) {
      for (int64_t d : {-1, -2, -3, -7, -8, -128}) divisors.push_back(d);
      divisors.push_back(type.min_int());
      divisors.push_back(type.max_int());
    }
    for (int lanes : {1, 5, 16}) {
      for (int64_t divisor : divisors) {
        const Scalar b = Scalar::of_int(type, divisor);
        for (Kind kind : {Kind::Div, Kind::Mod}) {
          check(
              text(kind_name(kind), " by ", divisor), {type}, type, lanes,
              [&](const auto &args) { return binary(kind, args[0], make_broadcast(to_expr(b), lanes)); },
              [&](const auto &args) { return eval_binary(kind, args[0], b); });
        }
      }
    }
  }
}

// Out of range, and for NaN, the IR leaves the integer open.
bool is_open(Type to, const Scalar &from) {
  if (!from.type.is_float() || to.is_float() || to.is_bool()) return false;
  const double whole = std::trunc(from.f);
  return !(whole >= static_cast<double>(to.is_int() ? to.min_int() : 0) &&
           whole < std::ldexp(1.0, to.is_int() ? to.bits() - 1 : to.bits()));
}

TEST(CodegenArithmetic, CastsBetweenAllTypes) {
  std::vector<Type> types(std::begin(number_types), std::end(number_types));
  types.push_back(Bool());
  for (Type from : types) {
    for (Type to : types) {
      for (int lanes : {1, 3, 16}) {
        check(
            "cast to " + to_string(to), {from, to}, to, lanes,
            [&](const auto &args) {
              // The second operand stands in where the first one's result is open.
              const Expr value = args[0];
              Expr result = cast_to(to.with_lanes(lanes), value);
              if (from.is_float() && !to.is_float() && !to.is_bool()) {
                const double low = static_cast<double>(to.is_int() ? to.min_int() : 0);
                const double high = std::ldexp(1.0, to.is_int() ? to.bits() - 1 : to.bits());
                const Expr wide = call_op(Op::trunc, {cast_to(Float(64, lanes), value)});
                const Expr fits = binary(Kind::And, binary(Kind::GE, wide, make_const(Float(64, lanes), low)),
                                         binary(Kind::LT, wide, make_const(Float(64, lanes), high)));
                result = make_select(fits, result, args[1]);
              }
              return result;
            },
            [&](const auto &args) { return is_open(to, args[0]) ? args[1] : eval_cast(to, args[0]); });
        check(
            "saturating_cast to " + to_string(to), {from}, to, lanes,
            [&](const auto &args) { return call_op(Op::saturating_cast, to.with_lanes(lanes), {args[0]}); },
            [&](const auto &args) { return *eval_operator(Op::saturating_cast, {args[0]}, to); });
      }
    }
  }
}

void check_operator(Op op, const std::vector<Type> &inputs, Type result, int lanes,
                    const Target &target = test_target()) {
  check(
      op_info(op).name, inputs, result, lanes,
      [&](const auto &args) { return call_op(op, result.with_lanes(lanes), args); },
      [&](const auto &args) { return *eval_operator(op, args, result); }, target);
}

TEST(CodegenArithmetic, IntegerOperators) {
  for (int lanes : {1, 5, 8, 32}) {
    if (240 % lanes) lanes = 16;
    for (Type type : number_types) {
      if (type.is_float()) continue;
      const Type magnitude = UInt(type.bits());
      for (Op op : {Op::bitwise_and, Op::bitwise_or, Op::bitwise_xor}) check_operator(op, {type, type}, type, lanes);
      check_operator(Op::bitwise_not, {type}, type, lanes);
      for (Op op : {Op::shift_left, Op::shift_right}) {
        check_operator(op, {type, type}, type, lanes);
        check_operator(op, {type, Int(type.bits())}, type, lanes);
        check_operator(op, {type, UInt(8)}, type, lanes);
        check_operator(op, {type, Int(64)}, type, lanes);
      }
      check_operator(Op::abs, {type}, magnitude, lanes);
      check_operator(Op::absd, {type, type}, magnitude, lanes);
      for (Op op : {Op::popcount, Op::count_leading_zeros, Op::count_trailing_zeros}) {
        check_operator(op, {type}, type, lanes);
      }
      if (type.bits() < 64) {
        check_operator(Op::lerp, {type, type, magnitude}, type, lanes);
        check_operator(Op::lerp, {type, type, UInt(8)}, type, lanes);
      }
    }
  }
}

TEST(CodegenArithmetic, FloatOperators) {
  std::vector<Target> targets = older_targets();
  targets.push_back(test_target());
  for (const Target &target : targets) {
    for (int lanes : {1, 3, 16}) {
      for (Type type : {Float(16), BFloat(16), Float(32), Float(64)}) {
        for (Op op : {Op::abs, Op::floor, Op::ceil, Op::round, Op::trunc, Op::sqrt}) {
          check_operator(op, {type}, type, lanes, target);
        }
        for (Op op : {Op::is_nan, Op::is_inf, Op::is_finite}) check_operator(op, {type}, Bool(), lanes, target);
        for (Op op : {Op::absd, Op::strong_mul}) check_operator(op, {type, type}, type, lanes, target);
      }
    }
  }
}

TEST(CodegenArithmetic, LerpWithFloatWeights) {
  RandomScalars random(7);
  for (Type type : {UInt(8), Int(16), UInt(32), Bool()}) {
    for (int step = 0; step <= 8; step++) {
      const Scalar weight = Scalar::of_float(Float(32), step / 8.0);
      check(
          text("lerp by ", weight.f), {type, type}, type, 8,
          [&](const auto &args) {
            return call_op(Op::lerp, {args[0], args[1], make_broadcast(to_expr(weight), 8)});
          },
          [&](const auto &args) { return *eval_operator(Op::lerp, {args[0], args[1], weight}, type); });
    }
  }
}

// A float lerp may fuse, so it is only near its definition; at the ends it is exact.
TEST(CodegenArithmetic, FloatLerpIsExactAtTheEnds) {
  for (double end : {0.0, 1.0}) {
    const Scalar weight = Scalar::of_float(Float(32), end);
    check(
        text("lerp by ", end), {UInt(16), UInt(16)}, Float(32), 4,
        [&](const auto &args) {
          return call_op(Op::lerp, {cast_to(Float(32, 4), args[0]), cast_to(Float(32, 4), args[1]),
                                    make_broadcast(to_expr(weight), 4)});
        },
        [&](const auto &args) { return eval_cast(Float(32), end == 0 ? args[0] : args[1]); });
  }
}

TEST(CodegenArithmetic, ContractionHappensUnlessStrict) {
  // (1 + e)^2 - (1 + 2 e) is e^2 when fused and 0 when not, for e = 2^-12 in float32.
  const double e = std::ldexp(1.0, -12);
  const auto result_of = [&](bool strict) {
    LoweredFunction f;
    f.name = "fused";
    f.args = {input("in", Float(32)), output("out", Float(32))};
    const Expr x = make_load(Float(32), "in", 0);
    Expr y = binary(Kind::Sub, binary(Kind::Mul, x, x), make_load(Float(32), "in", 1));
    if (strict) y = call_op(Op::strict_float, {y});
    f.body = make_store("out", y, 0);
    Array in(Float(32), 2), out(Float(32), 1);
    in.data<float>()[0] = static_cast<float>(1 + e);
    in.data<float>()[1] = static_cast<float>(1 + 2 * e);
    EXPECT_EQ(call(f, {&in, &out}), 0);
    return out.data<float>()[0];
  };
  EXPECT_EQ(result_of(true), 0.0f);
  if (test_target().has_feature(Target::FMA)) {
    EXPECT_EQ(result_of(false), static_cast<float>(e * e));
  }
}

TEST(CodegenArithmetic, ReinterpretKeepsBits) {
  for (int lanes : {1, 4, 5}) {
    for (auto [from, to] : {std::pair{Float(32), UInt(32)}, {Int(32), Float(32)}, {Float(64), Int(64)},
                            {Float(16), UInt(16)}, {UInt(16), BFloat(16)}}) {
      check(
          "reinterpret", {from}, to, lanes,
          [&, to = to](const auto &args) { return reinterpret_as(to.with_lanes(lanes), args[0]); },
          [&, to = to](const auto &args) { return eval_reinterpret(to, args[0]); });
    }
  }
}

}  // namespace
}  // namespace retrograde::testing_codegen

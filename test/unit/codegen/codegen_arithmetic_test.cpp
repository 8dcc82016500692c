// Machine code of arithmetic compared with the definition on scalars, on random and extreme
// operands, in every type, at widths that fit the machine's vectors and widths that do not.
#include "unit/codegen/codegen_testing.h"

namespace retrograde::testing_codegen {
namespace {

const int widths[] = {1, 2, 3, 4, 5, 8, 12, 16, 20};

const Type number_types[] = {Int(8),   Int(16),  Int(32),   Int(64),    UInt(8),   UInt(16),
                             UInt(32), UInt(64), Float(16), BFloat(16), Float(32), Float(64)};

// An operation on the operands, as machine code and by the scalar definitions.
struct Case {
  std::string name;
  Type result;
  std::function<Expr(const std::vector<Expr>&)> make;
  std::function<Scalar(const std::vector<Scalar>&)> oracle;
};
using Cases = std::vector<Case>;

// out<k>[i] = cases[k](in0[i], in1[i] ...) for i in [0, count), `lanes` at a time.
LoweredFunction elementwise(const std::vector<Type>& inputs, const Cases& cases, int lanes,
                            int count) {
  LoweredFunction function;
  function.name = "elementwise";
  const Expr index = lanes_at(variable("i") * lanes, lanes);
  std::vector<Expr> operands;
  for (size_t k = 0; k < inputs.size(); k++) {
    const std::string name = "in" + std::to_string(k);
    function.args.push_back(input(name, inputs[k]));
    operands.push_back(make_load(inputs[k].with_lanes(lanes), name, index));
  }
  std::vector<Stmt> stores;
  for (size_t k = 0; k < cases.size(); k++) {
    const std::string name = "out" + std::to_string(k);
    function.args.push_back(output(name, cases[k].result));
    stores.push_back(make_store(name, cases[k].make(operands), index));
  }
  function.body = make_for("i", 0, count / lanes, ForType::Serial, make_block(stores));
  return function;
}

constexpr int count = 240;  // divisible by all widths
using Operands = std::vector<std::unique_ptr<Array>>;

Operands random_operands(const std::vector<Type>& inputs, uint32_t seed) {
  RandomScalars random(seed);
  Operands operands;
  for (Type type : inputs) {
    operands.push_back(std::make_unique<Array>(type, count));
    for (size_t i = 0; i < count; i++) operands.back()->set(i, random(type));
  }
  return operands;
}

void check(Operands arrays, int lanes, const Cases& cases, const Target& target = test_target()) {
  std::vector<Type> inputs;
  for (const auto& array : arrays) inputs.push_back(array->type());
  for (const Case& c : cases) arrays.push_back(std::make_unique<Array>(c.result, count));
  std::vector<Array*> raw;
  for (auto& array : arrays) raw.push_back(array.get());
  ASSERT_EQ(call(elementwise(inputs, cases, lanes, count), raw, nullptr, target), 0)
      << cases[0].name;
  for (size_t i = 0; i < count; i++) {
    std::vector<Scalar> operands;
    std::string text;
    for (size_t k = 0; k < inputs.size(); k++) {
      operands.push_back(arrays[k]->get(i));
      text += " " + show(operands.back());
    }
    for (size_t k = 0; k < cases.size(); k++) {
      const Scalar expected = cases[k].oracle(operands), got = arrays[inputs.size() + k]->get(i);
      ASSERT_TRUE(same(expected, got))
          << cases[k].name << " of" << text << " in " << lanes << " lanes: " << show(got)
          << ", expected " << show(expected);
    }
  }
}

void check(const std::vector<Type>& inputs, int lanes, const Cases& cases,
           const Target& target = test_target()) {
  check(random_operands(inputs, static_cast<uint32_t>(lanes)), lanes, cases, target);
}

Case binary_case(Kind kind, Type type) {
  const bool compares = kind >= Kind::EQ && kind <= Kind::GE;
  return {kind_name(kind), compares ? Bool() : type,
          [=](const auto& args) { return binary(kind, args[0], args[1]); },
          [=](const auto& args) { return eval_binary(kind, args[0], args[1]); }};
}

Case operator_case(Op op, Type result, int lanes) {
  return {op_info(op).name, result,
          [=](const auto& args) { return call_op(op, result.with_lanes(lanes), args); },
          [=](const auto& args) { return *eval_operator(op, args, result); }};
}

Cases all_binary_cases(Type type) {
  Cases cases;
  for (int kind = static_cast<int>(Kind::Add); kind <= static_cast<int>(Kind::GE); kind++) {
    cases.push_back(binary_case(static_cast<Kind>(kind), type));
  }
  return cases;
}

TEST(CodegenArithmetic, BinaryOperatorsInEveryTypeAndWidth) {
  for (int lanes : widths) {
    for (Type type : number_types) check({type, type}, lanes, all_binary_cases(type));
  }
}

// Older processors of several generations, whose instructions this machine can run, too.
std::vector<Target> older_targets() {
  std::vector<Target> targets;
  const Target host = get_host_target();
  if (host.arch != Target::X86) return targets;
  for (const char* text :
       {"x86-64-linux", "x86-64-linux-sse41-avx", "x86-64-linux-sse41-avx-f16c-fma-avx2"}) {
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
  for (const Target& target : older_targets()) {
    for (int lanes : {1, 12}) {
      for (Type type : number_types) check({type, type}, lanes, all_binary_cases(type), target);
    }
  }
}

TEST(CodegenArithmetic, BooleansAndSelect) {
  for (int lanes : widths) {
    check({Bool(), Bool()}, lanes,
          {binary_case(Kind::And, Bool()),
           binary_case(Kind::Or, Bool()),
           binary_case(Kind::EQ, Bool()),
           binary_case(Kind::NE, Bool()),
           {"not", Bool(), [](const auto& args) { return logical_not(args[0]); },
            [](const auto& args) { return eval_not(args[0]); }}});
    for (Type type : {Int(16), Float(16), Float(32), Bool()}) {
      check(
          {Bool(), type, type}, lanes,
          {{"select", type, [](const auto& args) { return make_select(args[0], args[1], args[2]); },
            [](const auto& args) { return args[0].as_bool() ? args[1] : args[2]; }}});
    }
  }
}

// A sum with a strong product may fuse, so its value is compared only where the strong zero
// applies. There, nothing is added except for the sign of a zero, whatever the other factor is.
// Elsewhere the sum may be NaN only if an operand is.
TEST(CodegenArithmetic, SumsOfStrongProducts) {
  const auto is_zero = [](const Expr& e) { return binary(Kind::EQ, e, make_zero(e.type())); };
  std::vector<Target> targets = older_targets();
  targets.push_back(test_target());
  for (const Target& target : targets) {
    for (int lanes : {1, 3, 16}) {
      for (Type type : {Float(32), Float(64)}) {
        Cases cases;
        for (Kind kind : {Kind::Add, Kind::Sub}) {
          const auto sum = [=](const auto& args) {
            return binary(kind, args[2], call_op(Op::strong_mul, {args[0], args[1]}));
          };
          cases.push_back(
              {"where the first factor is zero", type,
               [=](const auto& args) { return make_select(is_zero(args[0]), sum(args), args[2]); },
               [](const auto& args) { return args[2]; }});
          cases.push_back({"is no number", Bool(),
                           [=](const auto& args) {
                             const Type mask = Bool().with_lanes(lanes);
                             return binary(Kind::And, call_op(Op::is_nan, mask, {sum(args)}),
                                           call_op(Op::is_finite, mask, {args[2]}));
                           },
                           [](const auto& args) {
                             const bool is_nan = std::isnan(args[0].f) ||
                                                 (args[0].f != 0 && std::isnan(args[1].f)) ||
                                                 (std::isinf(args[0].f) && args[1].f == 0);
                             return Scalar::of_int(Bool(), is_nan && std::isfinite(args[2].f));
                           }});
        }
        Operands operands = random_operands({type, type, type}, 3);
        for (size_t i = 0; i < count; i++) {
          if (i % 3 == 0) operands[0]->set(i, Scalar::of_float(type, i % 2 ? 0.0 : -0.0));
          if (operands[2]->get(i).f == 0) operands[2]->set(i, Scalar::of_float(type, 0.0));
        }
        check(std::move(operands), lanes, cases, target);
      }
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
      Cases cases;
      for (int64_t divisor : divisors) {
        const Scalar b = Scalar::of_int(type, divisor);
        for (Kind kind : {Kind::Div, Kind::Mod}) {
          cases.push_back({text(kind_name(kind), " by ", divisor), type,
                           [=](const auto& args) {
                             return binary(kind, args[0], make_broadcast(to_expr(b), lanes));
                           },
                           [=](const auto& args) { return eval_binary(kind, args[0], b); }});
        }
      }
      check({type}, lanes, cases);
    }
  }
}

// Quotients of floats close to an integer: large multiples of the divisor and their neighbours.
TEST(CodegenArithmetic, DivisionNextToWholeQuotients) {
  std::mt19937_64 random(1);
  for (Type type : {Int(8), UInt(8), Int(16), UInt(16), Int(32), UInt(32)}) {
    Operands operands = random_operands({type, type}, 1);
    for (size_t i = 0; i < count; i++) {
      const uint64_t largest = type.max_uint() >> (i % (type.bits() - 1));
      const auto divisor = static_cast<int64_t>(1 + random() % largest);
      const int64_t multiple = static_cast<int64_t>(type.max_uint()) / divisor * divisor;
      const int64_t near = multiple - 1 + static_cast<int64_t>(random() % 2);
      const bool negates = type.is_int() && random() % 2;
      operands[0]->set(i, Scalar::of_int(type, negates ? -near : near));
      operands[1]->set(i, Scalar::of_int(type, divisor));
    }
    check(std::move(operands), 8, {binary_case(Kind::Div, type), binary_case(Kind::Mod, type)});
  }
}

TEST(CodegenArithmetic, MostNegativeByMinusOne) {
  for (Type type : {Int(8), Int(16), Int(32), Int(64)}) {
    for (int lanes : {1, 5, 16}) {
      Operands operands = random_operands({type, type}, 1);
      for (size_t i = 0; i < count; i += 2) {
        operands[0]->set(i, Scalar::of_int(type, type.min_int()));
        operands[1]->set(i, Scalar::of_int(type, -1));
      }
      check(std::move(operands), lanes,
            {binary_case(Kind::Div, type), binary_case(Kind::Mod, type)});
    }
  }
}

// Whether the IR leaves the integer unspecified: out of range, or NaN.
bool is_open(Type to, const Scalar& from) {
  if (!from.type.is_float() || to.is_float() || to.is_bool()) return false;
  const double whole = std::trunc(from.f);
  return !(whole >= static_cast<double>(to.is_int() ? to.min_int() : 0) &&
           whole < std::ldexp(1.0, to.is_int() ? to.bits() - 1 : to.bits()));
}

// The cast, or zero where its result is unspecified.
Expr defined_cast(Type to, const Expr& value) {
  const Type from = value.type();
  const int lanes = from.lanes();
  const Expr result = cast_to(to.with_lanes(lanes), value);
  if (!from.is_float() || to.is_float() || to.is_bool()) return result;
  const double low = static_cast<double>(to.is_int() ? to.min_int() : 0);
  const double high = std::ldexp(1.0, to.is_int() ? to.bits() - 1 : to.bits());
  const Expr whole = call_op(Op::trunc, {cast_to(Float(64, lanes), value)});
  const Expr fits = binary(Kind::And, binary(Kind::GE, whole, make_const(Float(64, lanes), low)),
                           binary(Kind::LT, whole, make_const(Float(64, lanes), high)));
  return make_select(fits, result, make_zero(to.with_lanes(lanes)));
}

TEST(CodegenArithmetic, CastsBetweenAllTypes) {
  std::vector<Type> types(std::begin(number_types), std::end(number_types));
  types.push_back(Bool());
  std::vector<std::pair<Target, int>> setups = {{test_target(), 1}, {test_target(), 12}};
  for (const Target& target : older_targets()) setups.push_back({target, 5});
  for (const auto& [target, lanes_] : setups) {
    const int lanes = lanes_;
    for (Type from : types) {
      Cases cases;
      for (Type to : types) {
        cases.push_back({"cast to " + to_string(to), to,
                         [=](const auto& args) { return defined_cast(to, args[0]); },
                         [=](const auto& args) {
                           return is_open(to, args[0]) ? Scalar::of_int(to, 0)
                                                       : eval_cast(to, args[0]);
                         }});
        cases.push_back(operator_case(Op::saturating_cast, to, lanes));
      }
      check({from}, lanes, cases, target);
    }
  }
}

TEST(CodegenArithmetic, IntegerOperators) {
  for (int lanes : {1, 5, 8, 16}) {
    for (Type type : number_types) {
      if (type.is_float()) continue;
      const Type magnitude = UInt(type.bits());
      Cases cases = {operator_case(Op::absd, magnitude, lanes)};
      for (Op op :
           {Op::bitwise_and, Op::bitwise_or, Op::bitwise_xor, Op::shift_left, Op::shift_right}) {
        cases.push_back(operator_case(op, type, lanes));
      }
      check({type, type}, lanes, cases);
      cases = {operator_case(Op::abs, magnitude, lanes)};
      for (Op op :
           {Op::bitwise_not, Op::popcount, Op::count_leading_zeros, Op::count_trailing_zeros}) {
        cases.push_back(operator_case(op, type, lanes));
      }
      check({type}, lanes, cases);
      for (Type amount : {Int(type.bits()), UInt(8), Int(64)}) {
        check({type, amount}, lanes,
              {operator_case(Op::shift_left, type, lanes),
               operator_case(Op::shift_right, type, lanes)});
      }
      if (type.bits() == 64) continue;
      for (Type weight : {magnitude, UInt(8)})
        check({type, type, weight}, lanes, {operator_case(Op::lerp, type, lanes)});
    }
  }
}

// Products halfway between two numbers or that cancel with the addend, and addends far smaller than
// the precision that double keeps of the product.
Operands near_ties(Type type) {
  Operands operands;
  for (int k = 0; k < 3; ++k) operands.push_back(std::make_unique<Array>(type, count));
  const int digits = type.is_bfloat() ? 8 : type.bits() == 16 ? 11 : type.bits() == 32 ? 24 : 53;
  std::mt19937 random(7);
  const auto number = [&] {
    return 1 + std::ldexp(random() % 8, 1 - digits) + (random() % 4) / 4.0;
  };
  for (size_t i = 0; i < count; ++i) {
    const Scalar a = Scalar::of_float(type, number()), b = Scalar::of_float(type, number());
    const double tiny = std::ldexp(i % 2 ? 1.0 : -1.0, type == Float(16) ? -24 : -110);
    const Scalar c = Scalar::of_float(type, i % 4 < 2 ? tiny : -a.f * b.f);
    operands[0]->set(i, a), operands[1]->set(i, b), operands[2]->set(i, c);
  }
  return operands;
}

TEST(CodegenArithmetic, FloatOperators) {
  std::vector<Target> targets = older_targets();
  targets.push_back(test_target());
  for (const Target& target : targets) {
    for (int lanes : {1, 3, 16}) {
      for (Type type : {Float(16), BFloat(16), Float(32), Float(64)}) {
        Cases cases;
        for (Op op : {Op::abs, Op::floor, Op::ceil, Op::round, Op::trunc, Op::sqrt}) {
          cases.push_back(operator_case(op, type, lanes));
        }
        for (Op op : {Op::is_nan, Op::is_inf, Op::is_finite})
          cases.push_back(operator_case(op, Bool(), lanes));
        check({type}, lanes, cases, target);
        check({type, type}, lanes,
              {operator_case(Op::absd, type, lanes), operator_case(Op::strong_mul, type, lanes),
               operator_case(Op::strong_div, type, lanes)},
              target);
        check({type, type, type}, lanes, {operator_case(Op::fma, type, lanes)}, target);
        check(near_ties(type), lanes, {operator_case(Op::fma, type, lanes)}, target);
      }
    }
  }
}

TEST(CodegenArithmetic, LerpWithFloatWeights) {
  for (Type type : {UInt(8), Int(16), UInt(32), Bool()}) {
    Cases cases;
    for (int step = 0; step <= 8; step++) {
      const Scalar weight = Scalar::of_float(Float(32), step / 8.0);
      cases.push_back(
          {text("lerp by ", weight.f), type,
           [=](const auto& args) {
             return call_op(Op::lerp, {args[0], args[1], make_broadcast(to_expr(weight), 8)});
           },
           [=](const auto& args) {
             return *eval_operator(Op::lerp, {args[0], args[1], weight}, type);
           }});
    }
    check({type, type}, 8, cases);
  }
}

// A float lerp may fuse, so it only approximates its definition; at the ends it is exact.
TEST(CodegenArithmetic, FloatLerpIsExactAtTheEnds) {
  Cases cases;
  for (double end : {0.0, 1.0}) {
    const Expr weight = make_broadcast(Expr(static_cast<float>(end)), 4);
    cases.push_back(
        {text("lerp by ", end), Float(32),
         [=](const auto& args) {
           return call_op(Op::lerp,
                          {cast_to(Float(32, 4), args[0]), cast_to(Float(32, 4), args[1]), weight});
         },
         [=](const auto& args) { return eval_cast(Float(32), end == 0 ? args[0] : args[1]); }});
  }
  check({UInt(16), UInt(16)}, 4, cases);
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
    for (auto [from, to] : {std::pair{Float(32), UInt(32)},
                            {Int(32), Float(32)},
                            {Float(64), Int(64)},
                            {Float(16), UInt(16)},
                            {UInt(16), BFloat(16)}}) {
      check({from}, lanes,
            {{"reinterpret", to,
              [=, to = to](const auto& args) {
                return reinterpret_as(to.with_lanes(lanes), args[0]);
              },
              [=, to = to](const auto& args) { return eval_reinterpret(to, args[0]); }}});
    }
  }
}

}  // namespace
}  // namespace retrograde::testing_codegen

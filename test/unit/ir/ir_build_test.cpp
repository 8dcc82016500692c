// Builders: promotion, folding, equality, walks, trees of a million nodes, targets.
#include "ir/build.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ir/equal.h"
#include "ir/print.h"
#include "ir/scalar.h"
#include "ir/target.h"
#include "ir/visit.h"

namespace retrograde {
namespace {

using namespace ir;

Expr var(Type type) { return variable("v_" + to_string(type), type); }
Type sum_type(Type a, Type b) { return (var(a) + var(b)).type(); }

TEST(Promotion, FollowsTheLanguage) {
  EXPECT_EQ(sum_type(Int(8), Int(32)), Int(32));
  EXPECT_EQ(sum_type(UInt(8), UInt(16)), UInt(16));
  EXPECT_EQ(sum_type(UInt(8), Int(8)), Int(8));
  EXPECT_EQ(sum_type(UInt(32), Int(16)), Int(32));
  EXPECT_EQ(sum_type(Int(64), Float(32)), Float(32));
  EXPECT_EQ(sum_type(Int(32), Float(16)), Float(16));
  EXPECT_EQ(sum_type(Float(32), Float(64)), Float(64));
  EXPECT_EQ(sum_type(BFloat(16), Float(32)), Float(32));
  EXPECT_EQ(sum_type(Float(32), Int(32, 4)), Float(32, 4));
  EXPECT_THROW(sum_type(BFloat(16), Float(16)), UserError);
  EXPECT_THROW(sum_type(Int(32, 4), Int(32, 8)), UserError);
  EXPECT_THROW(var(Int(32)) + Expr(), UserError);
  EXPECT_THROW(var(Handle()) + 1, UserError);
  EXPECT_THROW(var(Int(32)) && var(Bool()), UserError);
}

TEST(Promotion, ConstantsTakeTheTypeOfTheOtherSide) {
  EXPECT_EQ((var(UInt(8)) + 200).type(), UInt(8));
  EXPECT_EQ((3 - var(Float(32))).type(), Float(32));
  EXPECT_EQ((var(Int(32)) * 0.5f).type(), Float(32));
  EXPECT_EQ((var(Float(32)) * 0.5).type(), Float(64));
  EXPECT_EQ(min(var(Int(16)), 7).type(), Int(16));
  EXPECT_EQ((var(UInt(8)) < 255).type(), Bool());
  EXPECT_THROW(var(UInt(8)) + 256, UserError);
  EXPECT_THROW(var(UInt(32)) - -1, UserError);
  EXPECT_THROW(var(Int(32)) + (int64_t{1} << 40), UserError);
  EXPECT_EQ(select(var(Bool()), var(UInt(8)), 0).type(), UInt(8));
}

TEST(Folding, ConstantsOfEveryType) {
  for (Type type :
       {Int(8), UInt(16), Int(32), UInt(64), Float(16), BFloat(16), Float(32), Float(64)}) {
    const Expr sum = binary(Kind::Add, make_const(type, 2), make_const(type, 3));
    EXPECT_TRUE(is_const(sum)) << sum;
    EXPECT_TRUE(equal(sum, make_const(type, 5))) << sum;
  }
  EXPECT_TRUE(is_const_int(make_const(UInt(8), 250) + 10, 4));
  EXPECT_TRUE(equal(call_op(Op::sqrt, {Expr(9.0f)}), Expr(3.0f)));
  EXPECT_TRUE(is_const_true(Expr(2) < Expr(3)));
  EXPECT_TRUE(
      is_const_int(binary(Kind::Add, make_const(Int(32, 4), 1), make_const(Int(32, 4), 2)), 3));
  EXPECT_EQ(cast_to(Int(8), Expr(1000.0f)).kind(), Kind::Cast)
      << "out of range is left to the machine";
}

TEST(Folding, IntegerIdentities) {
  const Expr x = variable("x");
  EXPECT_TRUE((x + 0).same_as(x));
  EXPECT_TRUE((0 + x).same_as(x));
  EXPECT_TRUE((x * 1).same_as(x));
  EXPECT_TRUE(is_const_int(x * 0, 0));
  EXPECT_TRUE((x / 1).same_as(x));
  EXPECT_TRUE(is_const_int(x / 0, 0));
  EXPECT_TRUE(is_const_int(x % 1, 0));
  EXPECT_TRUE(is_const_int(x - x, 0));
  EXPECT_TRUE(is_const_true(x == x));
}

TEST(Folding, FloatIdentitiesKeepEveryBit) {
  const Expr f = variable("f", Float(32));
  EXPECT_TRUE((f * 1.0f).same_as(f));
  EXPECT_TRUE((f / 1.0f).same_as(f));
  EXPECT_TRUE((f - 0.0f).same_as(f));
  EXPECT_TRUE((f + -0.0f).same_as(f));
  EXPECT_EQ((f + 0.0f).kind(), Kind::Add);
  EXPECT_EQ((f * 0.0f).kind(), Kind::Mul);
  EXPECT_EQ((f - f).kind(), Kind::Sub);
  EXPECT_EQ((f == f).kind(), Kind::EQ);
  EXPECT_TRUE(std::signbit(*as_const_float(-Expr(0.0f))));
}

TEST(Folding, Conditions) {
  const Expr c = variable("c", Bool()), x = variable("x"), y = variable("y");
  EXPECT_TRUE((c && Expr(true)).same_as(c));
  EXPECT_TRUE(is_const_false(c && Expr(false)));
  EXPECT_TRUE(is_const_true(Expr(true) || c));
  EXPECT_TRUE((!!c).same_as(c));
  EXPECT_TRUE(select(Expr(true), x, y).same_as(x));
  EXPECT_TRUE(select(c, x, x).same_as(x));
}

TEST(Builders, RejectWhatDoesNotFit) {
  const Expr x = variable("x"), f = variable("f", Float(32));
  EXPECT_THROW(binary(Kind::Add, x, f), InternalError);
  EXPECT_THROW(binary(Kind::And, x, x), InternalError);
  EXPECT_THROW(make_select(x, x, x), InternalError);
  EXPECT_THROW(call_op(Op::floor, {f, f}), InternalError);
  EXPECT_THROW(make_shuffle({make_broadcast(x, 2)}, {2}), InternalError);
  EXPECT_THROW(reinterpret_as(Int(64), x), InternalError);
}

TEST(Builders, BlocksFlattenAndEmptyStatementsVanish) {
  const Stmt s = make_store("a", Expr(1), Expr(0));
  EXPECT_FALSE(make_block({}).defined());
  EXPECT_TRUE(make_block({Stmt(), s, Stmt()}).same_as(s));
  EXPECT_EQ(make_block({make_block({s, s}), s}).as<Block>()->stmts.size(), 3u);
  EXPECT_FALSE(make_for("x", 0, 5, ForType::Serial, Stmt()).defined());
}

TEST(Equality, IsStructuralAndHashesAgree) {
  const auto make = [](int c) {
    const Expr x = variable("x"), f = variable("f", Float(32));
    return select(x * c < x + 2, call_op(Op::sqrt, {f}), cast(Float(32), x % 7));
  };
  EXPECT_TRUE(equal(make(3), make(3)));
  EXPECT_EQ(hash(make(3)), hash(make(3)));
  EXPECT_FALSE(equal(make(3), make(4)));
  EXPECT_EQ(compare(make(3), make(4)), -compare(make(4), make(3)));
  EXPECT_NE(compare(make(3), make(4)), 0);
  EXPECT_FALSE(equal(Expr(0.0f), Expr(-0.0f)));
}

TEST(Equality, IsLinearOnSharedNodes) {
  const auto tower = [] {
    Expr e = variable("x");
    for (int i = 0; i < 500; ++i) e = e * e + 1;
    return e;
  };
  EXPECT_TRUE(equal(tower(), tower()));
}

TEST(Depth, AMillionNodesAreWalkedAndDestroyed) {
  Expr e = variable("x");
  Stmt s = make_evaluate(variable("y"));
  for (int i = 0; i < 1000000; ++i) {
    e = binary(Kind::Add, e, e);
    s = make_for("i", 0, 2, ForType::Serial, s);
  }
  int nodes = 0;
  walk(e, [&](const Expr&) { return ++nodes > 0; });
  EXPECT_EQ(nodes, 1000001);
  EXPECT_TRUE(uses_variable(s, "y"));
  EXPECT_FALSE(uses_variable(e, "z"));
}

TEST(Visit, SubstituteIsLinearOnSharedNodesAndKeepsWhatDoesNotChange) {
  Expr e = variable("x");
  for (int i = 0; i < 500; ++i) e = e * e + variable("y");
  EXPECT_TRUE(substitute(e, "z", Expr(3)).same_as(e));
  const Expr replaced = substitute(e, "x", variable("z"));
  EXPECT_TRUE(uses_variable(replaced, "z"));
  EXPECT_FALSE(uses_variable(replaced, "x"));
  EXPECT_TRUE(uses_any_variable(e, {"q", "y"}));
}

TEST(Visit, EveryKindRebuildsWithItsChildren) {
  const Expr x = variable("x"), v = make_ramp(x, 2, 4);
  const Expr all[] = {cast(Float(32), x),
                      reinterpret_as(Float(32), x),
                      x + 3,
                      !(x < 3),
                      make_select(x < 3, x, Expr(1)),
                      make_load(Float(32), "a", x, x < 4),
                      v,
                      make_broadcast(x, 4),
                      call_op(Op::bitwise_and, {x, Expr(3)}),
                      call_image("im", Float(32), {x, x}, {}),
                      make_let("t", x, variable("t") + x),
                      make_shuffle({v, v}, {0, 5}),
                      make_vector_reduce(Kind::Add, v, 1)};
  for (const Expr& e : all) {
    const Expr renamed = substitute(e, "x", variable("w"));
    EXPECT_EQ(renamed.kind(), e.kind());
    EXPECT_EQ(renamed.type(), e.type());
    EXPECT_FALSE(uses_variable(renamed, "x")) << renamed;
    EXPECT_TRUE(equal(substitute(renamed, "w", x), e)) << renamed;
  }
}

TEST(Visit, AnyNodeStopsAtTheFirst) {
  Expr e = variable("x");
  for (int i = 0; i < 64; ++i) e = e * e + 1;  // 2^64 paths
  int visited = 0;
  const auto is_sum = [&](const Expr& node) { return ++visited, node.kind() == Kind::Add; };
  EXPECT_TRUE(any_node(e, is_sum));
  EXPECT_EQ(visited, 1);
  EXPECT_FALSE(any_node(e, [](const Expr& node) { return node.kind() == Kind::Load; }));
  EXPECT_FALSE(any_node(Expr(), is_sum));
}

TEST(Visit, AnyStmtLooksAtNoExpressions) {
  const Stmt loop =
      make_for("i", 0, 8, ForType::Serial, make_store("out", variable("x"), variable("i")));
  const auto is_store = [](const Stmt& s) { return s.kind() == Kind::Store; };
  const auto is_x = [](const Expr& e) { return e.as<Variable>() && e.as<Variable>()->name == "x"; };
  EXPECT_TRUE(any_stmt(loop, is_store));
  EXPECT_FALSE(any_stmt(loop, [](const Stmt& s) { return s.kind() == Kind::Assert; }));
  EXPECT_TRUE(any_node(loop, is_x, [](const Stmt&) { return false; }));
  EXPECT_FALSE(any_stmt(Stmt(), is_store));
}

TEST(Visit, UniqueNamesDiffer) { EXPECT_NE(unique_name("x"), unique_name("x")); }

TEST(Target, RoundTripsThroughText) {
  for (const char* text :
       {"x86-64-linux", "x86-64-linux-avx-avx2-f16c-fma", "arm-64-linux-no_asserts",
        "arch_unknown-0-os_unknown", "riscv-64-noos-rvv"}) {
    EXPECT_EQ(Target(text).to_string(), std::string(text));
  }
  EXPECT_EQ(Target(get_host_target().to_string()), get_host_target());
  EXPECT_TRUE(Target("host-no_asserts").has_feature(Target::NoAsserts));
  EXPECT_EQ(Target("x86-64-linux-trace_all").to_string(), "x86-64-linux-trace_all");
  EXPECT_TRUE(Target("x86-64-linux-trace_all").has_feature(Target::TraceStores));
  EXPECT_THROW(Target("x86-64-linux-avx3"), UserError);
  EXPECT_THROW(Target("x86-64"), UserError);
  EXPECT_THROW(Target("x86-64-linux-arm"), UserError);
  EXPECT_THROW(Target("x86-64-linux-"), UserError);
  EXPECT_FALSE(Target::validate_target_string("linux"));
  EXPECT_EQ(Target(""), get_host_target());
  EXPECT_EQ(Target("x86-64-linux-avx2").natural_vector_size<float>(), 8);
  EXPECT_EQ(Target("x86-64-linux-avx").natural_vector_size<float>(), 8);
  EXPECT_EQ(Target("x86-64-linux-avx").natural_vector_size<int>(), 4);
  EXPECT_EQ(Target("x86-64-linux-avx512_skylake").natural_vector_size<uint8_t>(), 64);
  EXPECT_EQ(Target("arm-64-linux").natural_vector_size<int16_t>(), 8);
}

TEST(Target, EveryFeatureHasANameOfItsOwn) {
  for (int i = 0; i < Target::FeatureEnd; i++) {
    const auto feature = static_cast<Target::Feature>(i);
    EXPECT_EQ(Target::feature_from_name(Target::feature_to_name(feature)), feature) << i;
  }
  EXPECT_EQ(Target::feature_from_name("avx3"), Target::FeatureEnd);
}

TEST(Target, SaysWhatNoCodeIsGeneratedFor) {
  EXPECT_TRUE(get_host_target().supported());
  EXPECT_EQ(Target("x86-64-linux-opencl").unsupported_part(), "opencl");
  EXPECT_TRUE(Target("x86-64-linux-cuda").has_gpu_feature());
  EXPECT_EQ(Target("x86-64-windows").unsupported_part(), "windows");
  EXPECT_EQ(Target("x86-64-linux-cuda").cuda_capability(), 75);
  EXPECT_EQ(Target("x86-64-linux-cuda-cuda_capability_86").cuda_capability(), 86);
  EXPECT_EQ(Target("hexagon-32-qurt-hvx").unsupported_part(), "qurt");
}

TEST(Target, OneRuntimeServesFeaturesThatItDoesNotSee) {
  Target common;
  const Target avx("x86-64-linux-avx2-fma-no_asserts"), wide("x86-64-linux-avx512-user_context");
  EXPECT_TRUE(avx.get_runtime_compatible_target(wide, common));
  EXPECT_EQ(common, Target("x86-64-linux"));
  EXPECT_FALSE(avx.get_runtime_compatible_target(Target("arm-64-linux"), common));
  const Target newer("arm-64-linux-armv87a-armv8a"), older("arm-64-linux-armv82a-armv83a");
  EXPECT_TRUE(newer.get_runtime_compatible_target(older, common));
  EXPECT_EQ(common.to_string(), "arm-64-linux-armv8a");
}

TEST(Select, LiteralsTakeTheTypeOfTheOtherArm) {
  const Expr c = variable("c", Bool());
  EXPECT_EQ(select(c, cast(UInt(8), 255), 0).type(), UInt(8));
  EXPECT_EQ(select(c, 0, variable("x", UInt(16))).type(), UInt(16));
  EXPECT_EQ(select(c, 1, 2).type(), Int(32));
  EXPECT_EQ(select(c, 300, variable("x", UInt(8))).type(), Int(32));  // 300 would not fit uint8
}

TEST(SmallFloats, RoundAfterEachOperation) {
  const float16_t a(1.5f), b(0.25f);
  EXPECT_EQ(static_cast<float>(a + b), 1.75f);
  EXPECT_EQ(static_cast<float>(a / b), 6.0f);
  EXPECT_TRUE(b < a && a == float16_t(1.5f) && -a < b);
  EXPECT_EQ(static_cast<float>(float16_t(2048.0f) + float16_t(1.0f)), 2048.0f);
  EXPECT_TRUE((float16_t::make_infinity() - float16_t::make_infinity()).is_nan());
  EXPECT_TRUE((bfloat16_t(1.0f) / bfloat16_t::make_zero()).is_infinity());
  EXPECT_TRUE(bfloat16_t::make_negative_zero().is_negative());
}

TEST(TypeLimits, AreExpressionsOfTheType) {
  EXPECT_EQ(as_const_int(Int(8).min()), -128);
  EXPECT_EQ(as_const_int(UInt(16).max()), 65535);
  EXPECT_EQ(as_const_int(UInt(16).min()), 0);
  EXPECT_EQ(as_const_float(Float(32).max()), std::numeric_limits<double>::infinity());
  EXPECT_EQ(Float(16).min().type(), Float(16));
  EXPECT_THROW(Handle().max(), UserError);
}

}  // namespace
}  // namespace retrograde

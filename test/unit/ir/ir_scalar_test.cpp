// Scalar operations: the definitions that the constant folder and the interpreter share.
#include "ir/scalar.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ir/build.h"

namespace retrograde {
namespace {

using namespace ir;

Scalar i32(int64_t v) { return Scalar::of_int(Int(32), v); }
Scalar i8(int64_t v) { return Scalar::of_int(Int(8), v); }
Scalar u8(uint64_t v) { return Scalar::of_uint(UInt(8), v); }
Scalar f32(double v) { return Scalar::of_float(Float(32), v); }
int64_t int_op(Kind kind, int64_t a, int64_t b) { return eval_binary(kind, i32(a), i32(b)).i; }

TEST(Scalar, IntegerDivisionLeavesANonNegativeRemainder) {
  for (int a = -20; a <= 20; ++a) {
    for (int b = -7; b <= 7; ++b) {
      const int64_t q = int_op(Kind::Div, a, b), r = int_op(Kind::Mod, a, b);
      if (b == 0) {
        EXPECT_EQ(q, 0);
        EXPECT_EQ(r, 0);
        continue;
      }
      EXPECT_EQ(q * b + r, a) << a << " / " << b;
      EXPECT_GE(r, 0) << a << " % " << b;
      EXPECT_LT(r, std::abs(b)) << a << " % " << b;
    }
  }
}

TEST(Scalar, IntegersWrap) {
  EXPECT_EQ(eval_binary(Kind::Add, i8(127), i8(1)).i, -128);
  EXPECT_EQ(eval_binary(Kind::Sub, u8(0), u8(1)).u, 255u);
  EXPECT_EQ(eval_binary(Kind::Mul, u8(16), u8(17)).u, 16u);
  EXPECT_EQ(eval_binary(Kind::Div, i8(-128), i8(-1)).i, -128);
  EXPECT_EQ(eval_cast(Int(8), i32(300)).i, 44);
  EXPECT_EQ(eval_cast(UInt(8), i32(-1)).u, 255u);
  EXPECT_EQ(eval_cast(Int(64), u8(255)).i, 255);
  const Scalar least = Scalar::of_int(Int(64), INT64_MIN), minus_one = Scalar::of_int(Int(64), -1);
  EXPECT_EQ(eval_binary(Kind::Div, least, minus_one).i, INT64_MIN);
  EXPECT_EQ(eval_binary(Kind::Mod, least, minus_one).i, 0);
  EXPECT_EQ(eval_binary(Kind::Mod, least, Scalar::of_int(Int(64), INT64_MIN)).i, 0);
}

TEST(Scalar, CastsToIntegersTruncateAndCastsToBoolCompareWithZero) {
  EXPECT_EQ(eval_cast(Int(32), f32(-2.75)).i, -2);
  EXPECT_EQ(eval_cast(UInt(8), f32(2.75)).u, 2u);
  EXPECT_EQ(eval_cast(Bool(), i32(2)).u, 1u);
  EXPECT_EQ(eval_cast(Bool(), f32(0.25)).u, 1u);
  EXPECT_EQ(eval_cast(Bool(), f32(-0.0)).u, 0u);
}

TEST(Scalar, SingleArithmeticRoundsToSingle) {
  EXPECT_EQ(eval_binary(Kind::Add, f32(16777216), f32(1)).f, 16777216.0);
  EXPECT_EQ(eval_binary(Kind::Div, f32(1), f32(3)).f, static_cast<double>(1.0f / 3.0f));
  EXPECT_TRUE(std::isinf(eval_binary(Kind::Mul, f32(1e30), f32(1e30)).f));
  EXPECT_EQ(eval_cast(Float(32), Scalar::of_int(Int(64), 9007199791611905)).f,
            static_cast<double>(static_cast<float>(9007199791611905)));
}

TEST(Scalar, MinAndMaxOfAnUnorderedPairGiveTheSecond) {
  EXPECT_EQ(eval_binary(Kind::Min, f32(NAN), f32(3)).f, 3);
  EXPECT_TRUE(std::isnan(eval_binary(Kind::Min, f32(3), f32(NAN)).f));
  EXPECT_EQ(eval_binary(Kind::Max, f32(NAN), f32(3)).f, 3);
  EXPECT_TRUE(std::signbit(eval_binary(Kind::Max, f32(0.0), f32(-0.0)).f));
}

TEST(Scalar, FloatModulusHasTheSignOfTheDivisor) {
  EXPECT_EQ(eval_binary(Kind::Mod, f32(-1.5), f32(4)).f, 2.5);
  EXPECT_EQ(eval_binary(Kind::Mod, f32(1.5), f32(-4)).f, -2.5);
}

double half(double v) { return static_cast<double>(float16_t(v)); }
double brain(double v) { return static_cast<double>(bfloat16_t(v)); }

TEST(Scalar, HalvesRoundToNearestEvenOnce) {
  EXPECT_EQ(half(2049), 2048);
  EXPECT_EQ(half(2051), 2052);
  EXPECT_EQ(half(65519.99), 65504);
  EXPECT_TRUE(std::isinf(half(65520)));
  EXPECT_EQ(half(5.960464477539063e-08), 5.960464477539063e-08);  // the smallest denormal
  EXPECT_EQ(half(2.980232238769531e-08), 0);                      // half of it: a tie, to even
  EXPECT_EQ(half(2.98023223876953125e-08 * 1.0001), 5.960464477539063e-08);
  EXPECT_TRUE(std::signbit(half(-1e-30)));
  // Just above a tie in double; rounding to float first would hit the tie and then round to the
  // wrong side.
  EXPECT_EQ(half(1 + 0x1p-11 + 0x1p-40), 1 + 0x1p-10);
  EXPECT_EQ(brain(1 + 0x1p-8 + 0x1p-40), 1 + 0x1p-7);
  EXPECT_EQ(brain(1 + 0x1p-8), 1);
  EXPECT_TRUE(std::isinf(brain(3.4e38)));
  EXPECT_TRUE(std::isnan(half(NAN)) && std::isnan(brain(NAN)));
}

TEST(Scalar, EveryHalfSurvivesTheWayThroughDouble) {
  for (int bits = 0; bits < 65536; ++bits) {
    const auto h = float16_t::make_from_bits(static_cast<uint16_t>(bits));
    const auto b = bfloat16_t::make_from_bits(static_cast<uint16_t>(bits));
    const double hd = static_cast<double>(h), bd = static_cast<double>(b);
    if (!std::isnan(hd)) {
      EXPECT_EQ(float16_t(hd).to_bits(), bits);
    }
    if (!std::isnan(bd)) {
      EXPECT_EQ(bfloat16_t(bd).to_bits(), bits);
    }
  }
}

Scalar run(Op op, std::vector<Scalar> args, Type type) { return *eval_operator(op, args, type); }

TEST(Operator, ShiftsByNegativeAmountsGoTheOtherWay) {
  EXPECT_EQ(run(Op::shift_left, {i32(5), i32(2)}, Int(32)).i, 20);
  EXPECT_EQ(run(Op::shift_left, {i32(20), i32(-2)}, Int(32)).i, 5);
  EXPECT_EQ(run(Op::shift_right, {i32(-8), i32(1)}, Int(32)).i, -4);
  EXPECT_EQ(run(Op::shift_right, {i32(-8), i32(-1)}, Int(32)).i, -16);
  EXPECT_EQ(run(Op::shift_right, {i32(-8), i32(40)}, Int(32)).i, -1);
  EXPECT_EQ(run(Op::shift_left, {i32(1), i32(32)}, Int(32)).i, 0);
  EXPECT_EQ(run(Op::shift_right, {u8(200), u8(3)}, UInt(8)).u, 25u);
}

TEST(Operator, AbsAndAbsdDoNotOverflow) {
  EXPECT_EQ(run(Op::abs, {i8(-128)}, UInt(8)).u, 128u);
  EXPECT_EQ(run(Op::absd, {i8(-128), i8(127)}, UInt(8)).u, 255u);
  EXPECT_EQ(run(Op::absd, {u8(3), u8(250)}, UInt(8)).u, 247u);
  EXPECT_EQ(run(Op::abs, {f32(-2.5)}, Float(32)).f, 2.5);
}

TEST(Operator, RoundGoesToEvenOnTies) {
  EXPECT_EQ(run(Op::round, {f32(0.5)}, Float(32)).f, 0);
  EXPECT_EQ(run(Op::round, {f32(1.5)}, Float(32)).f, 2);
  EXPECT_EQ(run(Op::round, {f32(-2.5)}, Float(32)).f, -2);
}

TEST(Operator, FmaRoundsOnce) {
  const double e = std::ldexp(1.0, -12);
  EXPECT_EQ(run(Op::fma, {f32(1 + e), f32(1 + e), f32(-(1 + 2 * e))}, Float(32)).f, e * e);
  const auto f64 = [](double v) { return Scalar::of_float(Float(64), v); };
  EXPECT_EQ(run(Op::fma, {f64(1 + e * e * e), f64(1 + e * e * e), f64(-1)}, Float(64)).f,
            2 * e * e * e + std::ldexp(1.0, -72));
  // The product lies halfway between two numbers; the addend, too small for double, decides.
  const auto bf16 = [](double v) { return Scalar::of_float(BFloat(16), v); };
  const double tiny = std::ldexp(1.0, -100);
  EXPECT_EQ(run(Op::fma, {bf16(9), bf16(29 / 256.0), bf16(tiny)}, BFloat(16)).f, 131 / 128.0);
  EXPECT_EQ(run(Op::fma, {bf16(7), bf16(37 / 256.0), bf16(-tiny)}, BFloat(16)).f, 129 / 128.0);
  EXPECT_EQ(run(Op::fma, {f32(4097), f32(4097 * 1024.0), f32(tiny)}, Float(32)).f,
            static_cast<double>(std::fma(4097.0f, 4097 * 1024.0f, static_cast<float>(tiny))));
  EXPECT_TRUE(std::isnan(run(Op::fma, {f32(INFINITY), f32(0), f32(1)}, Float(32)).f));
  EXPECT_EQ(run(Op::fma, {f32(INFINITY), f32(1), f32(1)}, Float(32)).f, INFINITY);
  EXPECT_TRUE(std::signbit(run(Op::fma, {f32(-1), f32(0), f32(-0.0)}, Float(32)).f));
}

TEST(Operator, LerpOfIntegersIsExactlyRounded) {
  for (int w = 0; w < 256; ++w) {
    for (int b : {0, 69, 255}) {
      const double exact = 42 + (b - 42) * (w / 255.0);
      EXPECT_EQ(run(Op::lerp, {u8(42), u8(static_cast<uint64_t>(b)), u8(static_cast<uint64_t>(w))},
                    UInt(8))
                    .u,
                static_cast<uint64_t>(std::floor(exact + 0.5)))
          << w << " " << b;
    }
  }
  EXPECT_EQ(run(Op::lerp, {i8(-128), i8(127), u8(255)}, Int(8)).i, 127);
  // Agrees with Halide 14: a wider weight loses its low bits first.
  EXPECT_EQ(run(Op::lerp, {u8(4), u8(207), Scalar::of_uint(UInt(16), 39037)}, UInt(8)).u, 124u);
  EXPECT_EQ(run(Op::lerp, {u8(42), u8(69), f32(0.5)}, UInt(8)).u, 55u);
  EXPECT_EQ(run(Op::lerp, {f32(10), f32(20), f32(0.25)}, Float(32)).f, 12.5);
  EXPECT_EQ(run(Op::lerp, {f32(10), f32(20), u8(255)}, Float(32)).f, 20);
}

TEST(Operator, SaturatingCastClamps) {
  EXPECT_EQ(run(Op::saturating_cast, {i32(300)}, UInt(8)).u, 255u);
  EXPECT_EQ(run(Op::saturating_cast, {i32(-300)}, UInt(8)).u, 0u);
  EXPECT_EQ(run(Op::saturating_cast, {i32(-300)}, Int(8)).i, -128);
  EXPECT_EQ(run(Op::saturating_cast, {f32(1e20)}, Int(32)).i, INT32_MAX);
  EXPECT_EQ(run(Op::saturating_cast, {f32(NAN)}, Int(32)).i, 0);
  EXPECT_EQ(run(Op::saturating_cast, {f32(1e20)}, Float(16)).f, 65504);
}

TEST(Operator, BitCounts) {
  EXPECT_EQ(run(Op::popcount, {i8(-1)}, Int(8)).i, 8);
  EXPECT_EQ(run(Op::count_leading_zeros, {u8(1)}, UInt(8)).u, 7u);
  EXPECT_EQ(run(Op::count_leading_zeros, {u8(0)}, UInt(8)).u, 8u);
  EXPECT_EQ(run(Op::count_trailing_zeros, {i32(8)}, Int(32)).i, 3);
  EXPECT_EQ(run(Op::count_trailing_zeros, {i32(0)}, Int(32)).i, 32);
}

TEST(Operator, StrongZeroBeatsInfinityAndNan) {
  EXPECT_EQ(run(Op::strong_mul, {f32(0), f32(INFINITY)}, Float(32)).f, 0);
  EXPECT_EQ(run(Op::strong_mul, {f32(-0.0), f32(NAN)}, Float(32)).f, 0);
  EXPECT_EQ(run(Op::strong_mul, {f32(2), f32(3)}, Float(32)).f, 6);
  EXPECT_TRUE(std::isnan(run(Op::strong_mul, {f32(2), f32(NAN)}, Float(32)).f));
  EXPECT_EQ(run(Op::strong_div, {f32(0), f32(0)}, Float(32)).f, 0);
  EXPECT_EQ(run(Op::strong_div, {f32(-0.0), f32(NAN)}, Float(32)).f, 0);
  EXPECT_EQ(run(Op::strong_div, {f32(3), f32(2)}, Float(32)).f, 1.5);
  EXPECT_EQ(run(Op::strong_div, {f32(3), f32(0)}, Float(32)).f, INFINITY);
}

TEST(Operator, EveryPureAndMarkerOperatorHasAMeaning) {
  for (int i = 0; i < op_count; ++i) {
    const Op op = static_cast<Op>(i);
    const OpInfo& info = op_info(op);
    EXPECT_EQ(op_from_name(info.name), op);
    const bool on_integers = std::string(info.name).find("bitwise") == 0 ||
                             std::string(info.name).find("shift") == 0 ||
                             std::string(info.name).find("count") != std::string::npos;
    const std::vector<Scalar> args(static_cast<size_t>(info.arity < 0 ? 1 : info.arity),
                                   on_integers ? i32(1) : f32(0.5));
    const bool has_meaning = info.cls == OpClass::Pure || info.cls == OpClass::Marker;
    if (!has_meaning) {
      EXPECT_FALSE(eval_operator(op, args, Float(32)).has_value()) << info.name;
      continue;
    }
    const Type type = on_integers                               ? Int(32)
                      : std::string(info.name).find("is_") == 0 ? Bool()
                                                                : Float(32);
    const std::optional<Scalar> value = eval_operator(op, args, type);
    ASSERT_TRUE(value.has_value()) << info.name;
    EXPECT_EQ(value->type, type) << info.name;
  }
  EXPECT_EQ(op_from_name("no such operator"), Op::none);
}

TEST(Operator, FastFormsAreTheFunctionsThatTheyApproximate) {
  EXPECT_EQ(run(Op::fast_exp, {f32(1.25)}, Float(32)).f, run(Op::exp, {f32(1.25)}, Float(32)).f);
  EXPECT_EQ(run(Op::fast_inverse_sqrt, {f32(4)}, Float(32)).f, 0.5);
}

}  // namespace
}  // namespace retrograde

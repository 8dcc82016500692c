// Programs that mean nothing, or not what they say: each is refused with all four parts of a
// message.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cmath>
#include <functional>

using namespace retrograde;

namespace {

struct Refused : testing::Test {
  Var x{"x"}, y{"y"}, xo{"xo"}, xi{"xi"}, xoo{"xoo"}, xoi{"xoi"};
  Expr u8 = cast<uint8_t>(x), i8 = cast<int8_t>(x), u16 = cast<uint16_t>(x), f32 = cast<float>(x);

  template <typename Kind = CompileError>
  static void expect(const std::function<void()>& program,
                     const std::vector<std::string>& phrases) {
    try {
      program();
      ADD_FAILURE() << "no error that mentions \"" << phrases[0] << "\"";
    } catch (const Kind& error) {
      for (const std::string& phrase : phrases) {
        EXPECT_NE(std::string(error.what()).find(phrase), std::string::npos)
            << "\"" << phrase << "\" in\n"
            << error.what();
      }
      const Message& message = error.message();
      EXPECT_FALSE(message.rule.empty()) << error.what();
      EXPECT_FALSE(message.evidence.empty()) << error.what();
      EXPECT_FALSE(message.instead.empty()) << error.what();
    }
  }
};

// ---- constants that would wrap ----

TEST_F(Refused, ClampToBoundsOfAnotherType) {
  expect([&] { clamp(i8, 0, 255); },
         {"a bound is a value of the type", "255 has no place in int8"});
  expect([&] { clamp(u8, -1, 10); }, {"-1 has no place in uint8"});
  expect([&] { clamp(x, 0.5f, 1); }, {"0.5 has no place in int32"});
  expect([&] { clamp(u8, x, 10); }, {"int32 has values that uint8 has not"});
  expect([&] { clamp(f32, 0, Expr(1e300)); }, {"1e+300 has no place in float32"});
  EXPECT_EQ(clamp(u8, cast<int>(cast<uint8_t>(y)), 10).type(), UInt(8));
  EXPECT_EQ(clamp(f32, 0, x).type(), Float(32));
  EXPECT_EQ(clamp(x, 0.0f, 1.0f).type(), Int(32));
}

TEST_F(Refused, LerpOfEndsThatDoNotFit) {
  expect([&] { lerp(u8, 300, 0.5f); }, {"a constant end", "300 has no place in uint8"});
  expect([&] { lerp(-1, u8, 0.5f); }, {"-1 has no place in uint8"});
  expect([&] { lerp(u8, i8, 0.5f); }, {"both values have one type", "uint8 and int8"});
  expect([&] { lerp(cast<int64_t>(x), cast<int64_t>(y), 0.5f); }, {"at most 32 bits", "int64"});
}

TEST_F(Refused, LerpByWeightsOfSignedTypes) {
  expect([&] { lerp(u8, u8, i8); }, {"a float or an unsigned integer", "int8"});
  expect([&] { lerp(u8, u8, -1); }, {"a float or an unsigned integer", "int32"});
  expect([&] { lerp(f32, f32, 3); }, {"a float or an unsigned integer", "int32"});
  EXPECT_EQ(lerp(u8, u8, 1).type(), UInt(8));
}

TEST_F(Refused, LerpOfIntegersByWeightsOutsideTheUnitInterval) {
  expect([&] { lerp(u8, u16 * 0 + u8, 2.0f); }, {"both values have one type"});
  expect([&] { lerp(u8, u8, 2.0f); }, {"weights in [0, 1]", "the weight is 2"});
  expect([&] { lerp(u8, u8, Expr(-0.25)); }, {"weights in [0, 1]", "-0.25"});
  expect([&] { lerp(u16, u16, Expr(NAN)); }, {"weights in [0, 1]"});
  EXPECT_EQ(lerp(f32, f32, 2.0f).type(), Float(32));
}

TEST_F(Refused, IntegersThatAFloatWouldRound) {
  expect([&] { f32 + 16777217; }, {"16777217", "must fit it", "float32"});
  expect([&] { cast(Float(16), x) * 70000; }, {"70000", "float16"});
  expect([&] { cast<double>(x) + ((int64_t{1} << 53) + 1); }, {"must fit it", "float64"});
  EXPECT_EQ((f32 + 16777216).type(), Float(32));
  EXPECT_EQ((cast<double>(x) + (int64_t{1} << 53)).type(), Float(64));
}

TEST_F(Refused, MeansWithConstantsThatDoNotFit) {
  expect([&] { halving_add(u8, 300); }, {"300 has no place in uint8"});
  expect([&] { rounding_halving_add(i8, 200); }, {"200 has no place in int8"});
  expect([&] { halving_sub(u8, -3); }, {"-3 has no place in uint8"});
  EXPECT_EQ(halving_add(u8, 3).type(), UInt(8));
}

TEST_F(Refused, DivisorsThatAreNoBytes) {
  expect([&] { fast_integer_divide(x, 300); }, {"the divisor is of type uint8", "300"});
  expect([&] { fast_integer_modulo(x, x); }, {"the divisor is of type uint8", "int32"});
  expect([&] { fast_integer_divide(f32, u8); }, {"an integer of 8, 16 or 32 bits", "float32"});
  expect([&] { fast_integer_divide_round_to_zero(cast<int64_t>(x), u8); }, {"int64"});
}

TEST_F(Refused, ExteriorsOfAnotherType) {
  Func f("f");
  f(x) = u8;
  const auto with = [&](const Expr& value) {
    return BoundaryConditions::constant_exterior(f, value, {{0, 10}});
  };
  expect([&] { with(300); }, {"one of the type inside", "300 has no place in uint8"});
  expect([&] { with(3.5f); }, {"3.5 has no place in uint8"});
  EXPECT_EQ(with(255).type(), UInt(8));
}

TEST_F(Refused, LimitsThatAParamCannotHold) {
  Param<uint8_t> p("p");
  expect([&] { p.set_range(0, 300); }, {"a value of the parameter's type", "300"});
  expect([&] { p.set_min_value(-1); }, {"-1 has no place in uint8"});
  expect([&] { p.set_estimate(256); }, {"256 has no place in uint8"});
}

TEST_F(Refused, SizesAndCoordinatesBeyond32Bits) {
  const Expr large = Expr(int64_t{1} << 40);
  Func f("f"), g("g"), h("h");
  f(x, y) = x;
  f.compute_root();
  expect([&] { RDom r(0, large); }, {"sizes and coordinates are of 32 bits", "1099511627776"});
  expect([&] { f(large, y) += 1; }, {"of 32 bits"});
  expect([&] { g(x) = f(x, large); }, {"of 32 bits"});
  expect([&] { f.bound(x, 0, large); }, {"of 32 bits"});
  expect([&] { f.bound(x, large, 5); }, {"of 32 bits"});
  expect([&] { f.align_bounds(x, 8, large); }, {"of 32 bits"});
  h(x, y) = f(x, y);
  expect([&] { h.prefetch(f, x, x, large); }, {"of 32 bits"});
  expect([&] { f.output_buffer().dim(0).set_min(large); }, {"of 32 bits"});
  expect([&] { BoundaryConditions::repeat_edge(f, {{0, large}}); }, {"of 32 bits"});
}

// ---- points that would run twice ----

TEST_F(Refused, AnUpdateRoundedUpInsideOfALoop) {
  Func f("f");
  f(x) = 0;
  f(x) += 1;
  expect([&] { f.update().split(x, xo, xi, 8).split(xi, xoo, xoi, 3, TailStrategy::RoundUp); },
         {"does not run a point twice", "RoundUp runs \"xi\" past its end", "GuardWithIf"});
}

TEST_F(Refused, AnUpdateRoundedUpOverAFusedInnerLoop) {
  Func f("f");
  f(x, y) = 0;
  f(x, y) += 1;
  Var t("t");
  f.update().split(x, xo, xi, 8).reorder(y, xi, xo).fuse(y, xi, t);
  expect([&] { f.update().vectorize(t, 5, TailStrategy::RoundUp); },
         {"does not run a point twice"});
}

TEST_F(Refused, NotAnUpdateRoundedUpWhereNothingIsRepeated) {
  const auto expect_ones = [&](const std::function<void(Stage)>& schedule) {
    Func f("f");
    f(x) = 0;
    f(x) += 1;
    schedule(f.update());
    const Buffer<int> out = f.realize({24});
    for (int i = 0; i < 24; i++) ASSERT_EQ(out(i), 1) << i;
  };
  const TailStrategy up = TailStrategy::RoundUp;
  expect_ones([&](Stage s) { s.split(x, xo, xi, 8, up); });
  expect_ones([&](Stage s) { s.split(x, xo, xi, 8).split(xi, xoo, xoi, 4, up); });
  expect_ones([&](Stage s) { s.split(x, xo, xi, 4, up).split(xo, xoo, xoi, 3, up); });
  expect_ones([&](Stage s) { s.rename(x, xo).split(xo, xoo, xoi, 6, up); });
}

// ---- atomic updates ----

TEST_F(Refused, AtomicUpdatesThatReadOtherElements) {
  RDom r(1, 8);
  const auto update = [&](const std::function<void(Func&)>& define) {
    Func f("f");
    f(x) = 0;
    define(f);
    return f.update().atomic(true);
  };
  const std::vector<std::string> phrases{"no element of its Func but the one that it writes"};
  expect([&] { update([&](Func& f) { f(r) = f(r - 1) + 1; }).parallel(r); }, phrases);
  expect([&] { update([&](Func& f) { f(r) = f(r) + f(0) * f(9 - r); }).vectorize(r); }, phrases);
  expect([&] { update([&](Func& f) { f(r % 4) = f(r % 4) + f(r % 2); }).parallel(r); }, phrases);
  update([&](Func& f) { f(r % 4) = 3 * f(r % 4) + f(20); }).parallel(r);  // never written
  update([&](Func& f) { f(r) = f(r - 1) + 1; }).unroll(r);
}

TEST_F(Refused, AtomicUpdatesOfATupleThatReadOtherElements) {
  Func f("f");
  RDom r(1, 8);
  f(x) = Tuple(0, 0);
  f(r) = Tuple(f(r)[0] + 1, f(r - 1)[0]);
  expect([&] { f.update().atomic(true).vectorize(r); }, {"no element of its Func but the one"});
  Realization out = f.realize({10});
  const Buffer<int> second = out[1];
  for (int i = 1; i <= 8; i++) EXPECT_EQ(second(i), i > 1);
}

// ---- undefined values ----

TEST_F(Refused, TuplesThatAreUndefinedInDifferentPlaces) {
  const auto realize = [&](const Tuple& values) {
    Func f("f");
    f(x) = Tuple(0, 0);
    f(x) = values;
    f.realize({10});
  };
  const std::vector<std::string> phrases{"undefined in the same places"};
  expect([&] { realize(select(x > 1, Tuple(1, 2), Tuple(undef<int>(), 3))); }, phrases);
  expect(
      [&] {
        realize({select(x > 1, 1, undef<int>()), select(x > 2, 1, undef<int>())});
      },
      phrases);
  realize({undef<int>(), 3});
  realize(select(x > 1, Tuple(1, 2), Tuple(undef<int>(), undef<int>())));
}

TEST_F(Refused, APureDefinitionThatIsUndefinedInDifferentPlaces) {
  Func f("f");
  f(x) = Tuple(select(x > 1, 1, undef<int>()), 2);
  expect([&] { f.realize({10}); }, {"undefined in the same places", "always"});
}

// ---- caches and levels ----

TEST_F(Refused, ASecondEvictionKey) {
  Param<int> a("a"), b("b");
  Func f("f");
  f(x) = x;
  f.compute_root().memoize(EvictionKey(a));
  expect([&] { f.memoize(EvictionKey(b)); }, {"one eviction key", "memoize", "before"});
  f.memoize();  // keeps the key
  EXPECT_TRUE(f.function()->schedule.eviction_key.defined());
}

TEST_F(Refused, LevelsThatWereNeverSet) {
  const LoopLevel nowhere;
  EXPECT_FALSE(nowhere.defined());
  const std::vector<std::string> phrases{"a loop, root or inlined", "never set"};
  expect([&] { nowhere.is_inlined(); }, phrases);
  expect([&] { nowhere.is_root(); }, phrases);
  expect([&] { nowhere.func(); }, phrases);
  expect([&] { nowhere.var(); }, phrases);
  expect([&] { nowhere.stage_index(); }, phrases);
  expect([&] { nowhere.to_string(); }, phrases);
  expect([&] { static_cast<void>(nowhere == LoopLevel::root()); }, phrases);
  expect([&] { LoopLevel::root().set(nowhere); }, phrases);
}

TEST_F(Refused, ProgramsComputedAtALevelThatWasNeverSet) {
  Func f("f"), g("g");
  f(x) = x;
  g(x) = f(x);
  for (const auto& direct : std::vector<std::function<void(const LoopLevel&)>>{
           [&](const LoopLevel& at) { f.compute_at(at); },
           [&](const LoopLevel& at) { f.compute_root().store_at(at); },
           [&](const LoopLevel& at) { f.compute_root().hoist_storage(at); },
           [&](const LoopLevel& at) { g.compute_with(at); }}) {
    direct(LoopLevel());
    expect([&] { g.realize({4}); }, {"set before the pipeline is compiled"});
    f.compute_root().store_root().hoist_storage_root();
  }
}

// ---- targets ----

TEST_F(Refused, TargetsAndFeaturesThatDoNotExist) {
  const std::string rule = "a target is arch-bits-os or host";
  for (const char* name : {"foo-bar", "x86-64-linux-foo", "x86-64", "x86-64-linux-", "host-sse99",
                           "linux-x86", "x86-65-linux", "x86-64-linux-x86"})
    expect([&] { Target target{std::string(name)}; }, {rule});
  EXPECT_EQ(Target::feature_from_name("sse99"), Target::FeatureEnd);
}

}  // namespace

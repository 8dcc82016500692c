// Programs without a meaning, or that do not mean what they say: each is rejected by a message with
// all four parts.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cmath>

#include "support/errors.h"

using namespace retrograde;

namespace {

struct Refused : testing::Test {
  Var x{"x"}, y{"y"}, xo{"xo"}, xi{"xi"}, xoo{"xoo"}, xoi{"xoi"};
  Expr u8 = cast<uint8_t>(x), i8 = cast<int8_t>(x), u16 = cast<uint16_t>(x), f32 = cast<float>(x);
};

// ---- constants that would wrap ----

TEST_F(Refused, ClampToBoundsOfAnotherType) {
  expect_error({"a bound is a value of the type", "255 does not fit int8"},
               [&] { clamp(i8, 0, 255); });
  expect_error({"-1 does not fit uint8"}, [&] { clamp(u8, -1, 10); });
  expect_error({"0.5 does not fit int32"}, [&] { clamp(x, 0.5f, 1); });
  expect_error({"int32 has values that uint8 has not"}, [&] { clamp(u8, x, 10); });
  expect_error({"1e+300 does not fit float32"}, [&] { clamp(f32, 0, Expr(1e300)); });
  EXPECT_EQ(clamp(u8, cast<int>(cast<uint8_t>(y)), 10).type(), UInt(8));
  EXPECT_EQ(clamp(f32, 0, x).type(), Float(32));
  EXPECT_EQ(clamp(x, 0.0f, 1.0f).type(), Int(32));
}

TEST_F(Refused, LerpOfEndsThatDoNotFit) {
  expect_error({"a constant end", "300 does not fit uint8"}, [&] { lerp(u8, 300, 0.5f); });
  expect_error({"-1 does not fit uint8"}, [&] { lerp(-1, u8, 0.5f); });
  expect_error({"both values have one type", "uint8 and int8"}, [&] { lerp(u8, i8, 0.5f); });
  expect_error({"at most 32 bits", "int64"},
               [&] { lerp(cast<int64_t>(x), cast<int64_t>(y), 0.5f); });
}

TEST_F(Refused, LerpOfConstantsOfDifferentTypes) {
  const Expr byte = cast<uint8_t>(42), word = cast<uint16_t>(0), wide = cast<uint32_t>(1023);
  expect_error({"both values have one type", "uint16 and uint8"}, [&] { lerp(word, byte, 0.5f); });
  expect_error({"both values have one type"}, [&] { lerp(u8, word, 0.5f); });
  expect_error({"both values have one type"}, [&] { lerp(u8, 2.0f, 0.5f); });
  // Literals take the type of the other end, constant or not.
  EXPECT_EQ(lerp(0, wide, 0.5f).type(), UInt(32));
  EXPECT_EQ(lerp(wide, 0, 0.5f).type(), UInt(32));
  EXPECT_EQ(lerp(0, cast(Float(16), x), 0.5f).type(), Float(16));
  EXPECT_EQ(lerp(1.0, f32, 0.5f).type(), Float(32));
}

// A call that also matches C++20's std::lerp of doubles.
TEST_F(Refused, LerpOfNumbersIsTheLanguagesOwn) {
  const Expr whole = lerp(42, 69, 0.25f);
  EXPECT_EQ(whole.type(), Int(32));
  EXPECT_EQ(*ir::as_const_int(whole), 49);
  const Expr mixed = lerp(1, 2.0f, 0.5f);
  EXPECT_EQ(mixed.type(), Float(32));
}

TEST_F(Refused, CoordinatesThatComeFromUndef) {
  Func g("g"), h("h");
  g(x) = 0;
  const std::initializer_list<std::string_view> phrases{"a coordinate has a value", "undef"};
  expect_error(phrases, [&] { g(undef<int>()) = 3; });
  expect_error(phrases, [&] { g(clamp(undef<int>(), 0, 9)) = 3; });
  expect_error(phrases, [&] { h(x) = g(undef<int>()); });
  expect_error(phrases, [&] { h(x) = g(select(x > 2, x, undef<int>())) + 1; });
  const Buffer<int> image(10);
  expect_error(phrases, [&] { h(x) = image(undef<int>()); });
}

TEST_F(Refused, LerpByWeightsOfSignedTypes) {
  expect_error({"a float or an unsigned integer", "int8"}, [&] { lerp(u8, u8, cast<int8_t>(1)); });
  expect_error({"a float or an unsigned integer", "int8"}, [&] { lerp(u8, u8, i8); });
  expect_error({"a float or an unsigned integer", "int32"}, [&] { lerp(u8, u8, -1); });
  expect_error({"a float or an unsigned integer", "int32"}, [&] { lerp(f32, f32, 3); });
  EXPECT_EQ(lerp(u8, u8, 1).type(), UInt(8));
}

TEST_F(Refused, LerpOfIntegersByWeightsOutsideTheUnitInterval) {
  expect_error({"both values have one type"}, [&] { lerp(u8, u16 * 0 + u8, 2.0f); });
  expect_error({"weights in [0, 1]", "the weight is 2"}, [&] { lerp(u8, u8, 2.0f); });
  expect_error({"weights in [0, 1]", "-0.25"}, [&] { lerp(u8, u8, Expr(-0.25)); });
  expect_error({"weights in [0, 1]"}, [&] { lerp(u16, u16, Expr(NAN)); });
  EXPECT_EQ(lerp(f32, f32, 2.0f).type(), Float(32));
}

TEST_F(Refused, IntegersThatAFloatWouldRound) {
  expect_error({"16777217", "must fit it", "float32"}, [&] { f32 + 16777217; });
  expect_error({"70000", "float16"}, [&] { cast(Float(16), x) * 70000; });
  expect_error({"must fit it", "float64"}, [&] { cast<double>(x) + ((int64_t{1} << 53) + 1); });
  EXPECT_EQ((f32 + 16777216).type(), Float(32));
  EXPECT_EQ((cast<double>(x) + (int64_t{1} << 53)).type(), Float(64));
}

TEST_F(Refused, MeansWithConstantsThatDoNotFit) {
  expect_error({"300 does not fit uint8"}, [&] { halving_add(u8, 300); });
  expect_error({"200 does not fit int8"}, [&] { rounding_halving_add(i8, 200); });
  expect_error({"-3 does not fit uint8"}, [&] { halving_sub(u8, -3); });
  EXPECT_EQ(halving_add(u8, 3).type(), UInt(8));
}

TEST_F(Refused, DivisorsThatAreNoBytes) {
  expect_error({"the divisor is of type uint8", "300"}, [&] { fast_integer_divide(x, 300); });
  expect_error({"the divisor is of type uint8", "int32"}, [&] { fast_integer_modulo(x, x); });
  expect_error({"an integer of 8, 16 or 32 bits", "float32"},
               [&] { fast_integer_divide(f32, u8); });
  expect_error({"int64"}, [&] { fast_integer_divide_round_to_zero(cast<int64_t>(x), u8); });
}

TEST_F(Refused, ExteriorsOfAnotherType) {
  Func f("f");
  f(x) = u8;
  const auto with = [&](const Expr& value) {
    return BoundaryConditions::constant_exterior(f, value, {{0, 10}});
  };
  expect_error({"the type of the values inside", "300 does not fit uint8"}, [&] { with(300); });
  expect_error({"3.5 does not fit uint8"}, [&] { with(3.5f); });
  EXPECT_EQ(with(255).type(), UInt(8));
}

TEST_F(Refused, LimitsThatAParamCannotHold) {
  Param<uint8_t> p("p");
  expect_error({"a value of the parameter's type", "300"}, [&] { p.set_range(0, 300); });
  expect_error({"-1 does not fit uint8"}, [&] { p.set_min_value(-1); });
  expect_error({"256 does not fit uint8"}, [&] { p.set_estimate(256); });
}

TEST_F(Refused, SizesAndCoordinatesBeyond32Bits) {
  const Expr large = Expr(int64_t{1} << 40);
  Func f("f"), g("g"), h("h");
  f(x, y) = x;
  f.compute_root();
  expect_error({"sizes and coordinates are of 32 bits", "1099511627776"},
               [&] { RDom r(0, large); });
  expect_error({"of 32 bits"}, [&] { f(large, y) += 1; });
  expect_error({"of 32 bits"}, [&] { g(x) = f(x, large); });
  expect_error({"of 32 bits"}, [&] { f.bound(x, 0, large); });
  expect_error({"of 32 bits"}, [&] { f.bound(x, large, 5); });
  expect_error({"of 32 bits"}, [&] { f.align_bounds(x, 8, large); });
  h(x, y) = f(x, y);
  expect_error({"of 32 bits"}, [&] { h.prefetch(f, x, x, large); });
  expect_error({"of 32 bits"}, [&] { f.output_buffer().dim(0).set_min(large); });
  expect_error({"of 32 bits"}, [&] { BoundaryConditions::repeat_edge(f, {{0, large}}); });
}

TEST_F(Refused, ConstantsThatOverflow) {
  const Expr large = 0x12345678, huge = Expr(INT64_MAX);
  const auto define = [&](const Expr& value) {
    Func f("f");
    f(x) = value;
    return Buffer<>(f.realize({1})).type();
  };
  const std::initializer_list<std::string_view> phrases{
      "constants of int32 and int64 do not overflow", "does not fit int32"};
  expect_error(phrases, [&] { define(large * Expr(0x76543210)); });
  expect_error(phrases, [&] { define(x + select(x > 3, x, Expr(INT32_MAX) + 1)); });
  expect_error(phrases, [&] { define(Expr(INT32_MIN) - 1); });
  expect_error({"does not fit int64"}, [&] { define(huge + huge); });
  expect_error(phrases, [&] {
    Func f("f");
    f(x) = 0;
    f(large * 16) += 1;
  });
  // In a wider type there is room, and unsigned arithmetic wraps around.
  EXPECT_EQ(define(cast<int64_t>(large) * Expr(0x76543210)), halide_type_of<int64_t>());
  EXPECT_EQ(define(cast<uint32_t>(large) * cast<uint32_t>(0x76543210)), halide_type_of<uint32_t>());
  EXPECT_EQ(define(cast<int16_t>(32767) + cast<int16_t>(1)), halide_type_of<int16_t>());
  EXPECT_EQ(define(Expr(INT32_MAX - 1) + 1), halide_type_of<int32_t>());
}

// ---- points that would run twice ----

TEST_F(Refused, AnUpdateRoundedUpInsideOfALoop) {
  Func f("f");
  f(x) = 0;
  f(x) += 1;
  expect_error(
      {"does not run a point twice", "RoundUp runs \"xi\" past its end", "GuardWithIf"},
      [&] { f.update().split(x, xo, xi, 8).split(xi, xoo, xoi, 3, TailStrategy::RoundUp); });
}

TEST_F(Refused, AnUpdateRoundedUpOverAFusedInnerLoop) {
  Func f("f");
  f(x, y) = 0;
  f(x, y) += 1;
  Var t("t");
  f.update().split(x, xo, xi, 8).reorder(y, xi, xo).fuse(y, xi, t);
  expect_error({"does not run a point twice"},
               [&] { f.update().vectorize(t, 5, TailStrategy::RoundUp); });
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
  const std::initializer_list<std::string_view> phrases{
      "no element of its Func but the one that it writes"};
  expect_error(phrases, [&] { update([&](Func& f) { f(r) = f(r - 1) + 1; }).parallel(r); });
  expect_error(phrases,
               [&] { update([&](Func& f) { f(r) = f(r) + f(0) * f(9 - r); }).parallel(r); });
  expect_error(phrases,
               [&] { update([&](Func& f) { f(r % 4) = f(r % 4) + f(r % 2); }).parallel(r); });
  update([&](Func& f) { f(r % 4) = 3 * f(r % 4) + f(20); }).parallel(r);  // never written
  update([&](Func& f) { f(r) = f(r - 1) + 1; }).unroll(r);
  update([&](Func& f) { f(r) = f(r - 1) + 1; }).vectorize(r);  // lanes take turns
}

TEST_F(Refused, AtomicUpdatesOfATupleThatReadOtherElements) {
  Func f("f");
  RDom r(1, 8);
  f(x) = Tuple(0, 0);
  f(r) = Tuple(f(r)[0] + 1, f(r - 1)[0]);
  expect_error({"no element of its Func but the one"},
               [&] { f.update().atomic(true).parallel(r); });
  f.update().vectorize(r);  // lanes take turns
  Realization out = f.realize({10});
  const Buffer<int> second = out[1];
  for (int i = 1; i <= 8; i++) EXPECT_EQ(second(i), i > 1);
}

// ---- loops that are fused after they were made parallel ----

TEST_F(Refused, LoopsThatRaceWhenTheyAreOne) {
  RDom r(0, 9, "r");
  RVar t("t");
  const auto update = [&](const std::function<void(Stage)>& schedule) {
    Func f("f");
    f(x, y) = 0;
    f(x, y) += r;
    f.bound(x, 0, 8).bound(y, 0, 8);
    schedule(f.update());
    const Buffer<int> out = f.realize({8, 8});
    for (int i = 0; i < 64; i++) ASSERT_EQ(out(i % 8, i / 8), 36);
  };
  const std::initializer_list<std::string_view> parallel{
      "where \"x\" is parallel", "must not touch the same element", "is a reduction variable",
      " apart; or make the update atomic()"};
  expect_error(parallel, [&] { update([&](Stage s) { s.parallel(x).fuse(r, x, t); }); });
  expect_error(parallel, [&] { update([&](Stage s) { s.parallel(x).fuse(x, r, t); }); });
  expect_error({"where \"x\" is vectorized", "must not touch the same element"},
               [&] { update([&](Stage s) { s.vectorize(x).fuse(x, r, t); }); });
  expect_error({"where \"x\" is vectorized"},
               [&] { update([&](Stage s) { s.vectorize(x).fuse(r, x, t); }); });
  expect_error({"where \"x\" runs on a GPU"},
               [&] { update([&](Stage s) { s.gpu_blocks(x).fuse(r, x, t); }); });
  expect_error(parallel, [&] { update([&](Stage s) { s.parallel(x).fuse(r, x, t).serial(t); }); });
  // Pure loops, serial loops and atomic updates are not affected.
  update([&](Stage s) { s.parallel(y).fuse(x, y, Var("t")); });
  update([&](Stage s) { s.fuse(r, x, t).parallel(y); });
  update([&](Stage s) { s.atomic().parallel(x).fuse(r, x, t); });
}

TEST_F(Refused, NotParallelReductionLoopsThatNeverMeet) {
  RDom r(0, 8, 0, 8, "r");
  RVar t("t");
  Func f("f");
  f(x, y) = 0;
  f(r.x, r.y) = r.x + 10 * r.y;
  f.update().parallel(r.y).fuse(r.x, r.y, t);
  const Buffer<int> out = f.realize({8, 8});
  for (int i = 0; i < 64; i++) EXPECT_EQ(out(i % 8, i / 8), i % 8 + 10 * (i / 8));
}

// ---- undefined values ----

TEST_F(Refused, TuplesThatAreUndefinedInDifferentPlaces) {
  const auto realize = [&](const Tuple& values) {
    Func f("f");
    f(x) = Tuple(0, 0);
    f(x) = values;
    f.realize({10});
  };
  const std::initializer_list<std::string_view> phrases{"undefined in the same places"};
  expect_error(phrases, [&] { realize(select(x > 1, Tuple(1, 2), Tuple(undef<int>(), 3))); });
  expect_error(phrases, [&] {
    realize({select(x > 1, 1, undef<int>()), select(x > 2, 1, undef<int>())});
  });
  realize({undef<int>(), 3});
  realize(select(x > 1, Tuple(1, 2), Tuple(undef<int>(), undef<int>())));
}

TEST_F(Refused, APureDefinitionThatIsUndefinedInDifferentPlaces) {
  Func f("f");
  f(x) = Tuple(select(x > 1, 1, undef<int>()), 2);
  expect_error({"undefined in the same places", "always"}, [&] { f.realize({10}); });
}

// ---- caches and levels ----

TEST_F(Refused, ASecondEvictionKey) {
  Param<int> a("a"), b("b");
  Func f("f");
  f(x) = x;
  f.compute_root().memoize(EvictionKey(a));
  expect_error({"one eviction key", "memoize", "before"}, [&] { f.memoize(EvictionKey(b)); });
  f.memoize();  // keeps the key
  EXPECT_TRUE(f.function()->schedule.eviction_key.defined());
}

TEST_F(Refused, LevelsThatWereNeverSet) {
  const LoopLevel nowhere;
  EXPECT_FALSE(nowhere.defined());
  const std::initializer_list<std::string_view> phrases{"a loop, root or inlined", "never set"};
  expect_error(phrases, [&] { nowhere.is_inlined(); });
  expect_error(phrases, [&] { nowhere.is_root(); });
  expect_error(phrases, [&] { nowhere.func(); });
  expect_error(phrases, [&] { nowhere.var(); });
  expect_error(phrases, [&] { nowhere.stage_index(); });
  expect_error(phrases, [&] { nowhere.to_string(); });
  expect_error(phrases, [&] { static_cast<void>(nowhere == LoopLevel::root()); });
  expect_error(phrases, [&] { LoopLevel::root().set(nowhere); });
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
    expect_error({"set before the pipeline is compiled"}, [&] { g.realize({4}); });
    f.compute_root().store_root().hoist_storage_root();
  }
}

// ---- targets ----

TEST_F(Refused, TargetsAndFeaturesThatDoNotExist) {
  const std::string rule = "a target is arch-bits-os or host";
  for (const char* name : {"foo-bar", "x86-64-linux-foo", "x86-64", "x86-64-linux-", "host-sse99",
                           "linux-x86", "x86-65-linux", "x86-64-linux-x86"})
    expect_error({rule}, [&] { Target target{std::string(name)}; });
  EXPECT_EQ(Target::feature_from_name("sse99"), Target::FeatureEnd);
}

TEST_F(Refused, VectorsOfATargetThatNobodyNamed) {
  Target half = get_host_target();
  half.arch = Target::ArchUnknown;
  for (const Target& target : {Target(), half})
    expect_error({"the target is known", "unknown", "get_host_target()"},
                 [&] { target.natural_vector_size<float>(); });
}

TEST_F(Refused, DevicesThatTheTargetHasNot) {
  const Target host = get_host_target(), cuda = host.with_feature(Target::CUDA);
  Buffer<int> b(4);
  b.fill(1);
  const std::string named = host.to_string();
  for (const DeviceAPI device : {DeviceAPI::CUDA, DeviceAPI::Default_GPU}) {
    const std::initializer_list<std::string_view> phrases{"the target has a feature of the device",
                                                          named, "Target::CUDA"};
    expect_error(phrases, [&] { get_device_interface_for_device_api(device, host, "ask"); });
    expect_error(phrases, [&] { b.copy_to_device(device, host); });
    EXPECT_EQ(get_device_interface_for_device_api(device, host), nullptr);
    EXPECT_NE(get_device_interface_for_device_api(device, cuda, "ask"), nullptr);
    EXPECT_NE(get_device_interface_for_device_api(device, Target(), "ask"), nullptr);
  }
  EXPECT_EQ(get_device_interface_for_device_api(DeviceAPI::Host, host, "ask"), nullptr);
}

}  // namespace

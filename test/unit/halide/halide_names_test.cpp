// Less common names of Halide's API: effects are compared with plain C++, and unsupported uses give
// errors.
#include "Halide.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <thread>

#include "support/errors.h"

using namespace Halide;
using retrograde::error_of;
using retrograde::expect_error;
using retrograde::expect_mentions;
using retrograde::Unsupported;

namespace {

// out(x) = in(x) * factor
struct Scaled {
  ImageParam in{Int(32), 1, "in"};
  Param<int> factor{"factor"};
  Func out{"out"};
  Var x{"x"};
  Scaled() { out(x) = in(x)*factor; }
};

Buffer<int> ramp(int size, int first = 0) {
  Buffer<int> result(size);
  for (int i = 0; i < size; i++) result(i) = first + i;
  return result;
}

// ---- ParamMap ----

TEST(ParamMaps, StandInForWhatWasSet) {
  Scaled s;
  Buffer<int> set = ramp(4), mapped = ramp(4, 100);
  s.in.set(set);
  s.factor.set(2);
  Buffer<int> plain = s.out.realize({4});
  Buffer<int> other = s.out.realize({4}, Target(), {{s.factor, 3}, {s.in, mapped}});
  ParamMap map;
  map.set(s.factor, 5);
  EXPECT_EQ(map.size(), 1u);
  Buffer<int> into(4);
  Pipeline(s.out).realize(into, get_jit_target_from_environment(), map);
  for (int i = 0; i < 4; i++) {
    EXPECT_EQ(plain(i), 2 * i);
    EXPECT_EQ(other(i), 3 * (100 + i));
    EXPECT_EQ(into(i), 5 * i);
  }
  EXPECT_EQ(s.factor.get(), 2);
}

TEST(ParamMaps, OfTheirOwnServeThreads) {
  Scaled s;
  s.out.compile_jit();
  const Pipeline pipeline(s.out);
  std::vector<std::thread> threads;
  std::vector<Buffer<int>> results(4);
  for (int t = 0; t < 4; t++) {
    threads.emplace_back([&, t] {
      Buffer<int> in = ramp(50, t);
      for (int i = 0; i < 20; i++)
        results[t] = Pipeline(pipeline).realize({50}, Target(), {{s.factor, t}, {s.in, in}});
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (int t = 0; t < 4; t++) EXPECT_EQ(results[t](49), t * (49 + t));
}

TEST(ParamMaps, TakeInferredImages) {
  Scaled s;
  Buffer<int> wanted;
  s.out.infer_input_bounds({7}, Target(), {{s.in, &wanted}, {s.factor, 1}});
  ASSERT_TRUE(wanted.defined());
  EXPECT_EQ(wanted.dim(0).extent(), 7);
  EXPECT_FALSE(s.in.get().defined());
}

TEST(ParamMaps, RefuseWhatDoesNotFit) {
  Scaled s;
  Buffer<float> floats(4);
  expect_error({"\"in\"", "it takes int32", "holds float32"}, [&] { ParamMap{{s.in, floats}}; });
  expect_error({"\"factor\"", "must fit"}, [&] { ParamMap{{s.factor, 2.5}}; });
  expect_error<RuntimeError>({"\"in\" needs a buffer"}, [&] {
    s.out.realize({4}, Target(), {{s.factor, 1}});
  });
}

// ---- Callable ----

TEST(Callables, TakeTheirArgumentsInOrder) {
  Scaled s;
  const Callable scaled = s.out.compile_to_callable({s.factor, s.in});
  Buffer<int> in = ramp(5), out(5);
  EXPECT_EQ(scaled(7, in, out), 0);
  EXPECT_EQ(out(4), 28);
  JITUserContext context;
  EXPECT_EQ(scaled(&context, 8, in, out), 0);
  EXPECT_EQ(out(4), 32);
  const auto function = scaled.make_std_function<int, Buffer<int>, Buffer<int>>();
  EXPECT_EQ(function(9, in, out), 0);
  EXPECT_EQ(out(4), 36);
  const auto with_context =
      scaled.make_std_function<JITUserContext*, int, Buffer<int, 1>, Buffer<int, 1>>();
  EXPECT_EQ(with_context(&context, 10, in, out), 0);
  EXPECT_EQ(out(4), 40);
}

TEST(Callables, RefuseWhatDoesNotFit) {
  Scaled s;
  const Callable scaled = Pipeline(s.out).compile_to_callable({s.factor, s.in});
  Buffer<int> in = ramp(5), out(5);
  expect_error<RuntimeError>({"there are 3", "2 were given"}, [&] { scaled(1, in); });
  expect_error<RuntimeError>({"argument 1", "\"factor\"", "float32 was given"},
                             [&] { scaled(1.0f, in, out); });
  expect_error<RuntimeError>({"must be a scalar"}, [&] { scaled(in, 1, out); });
  expect_error<RuntimeError>({"argument 2", "must be a buffer"},
                             [&] { scaled.make_std_function<int, int, int>(); });
  expect_error({"\"factor\" is not among them"}, [&] { s.out.compile_to_callable({s.in}); });
  expect_error({"without a pipeline"}, [&] { Callable()(); });
}

// ---- events of a pipeline ----

int events = 0;

TEST(TracePipeline, TellsWhenACallBeginsAndEnds) {
  Func f("f");
  Var x("x");
  f(x) = x;
  Pipeline pipeline(f);
  pipeline.set_custom_trace([](void*, const halide_trace_event_t* event) {
    const bool is_begin = event->event == halide_trace_begin_pipeline;
    if (is_begin || event->event == halide_trace_end_pipeline) events++;
    return 1;
  });
  pipeline.realize({3});
  EXPECT_EQ(events, 0);
  pipeline.trace_pipeline();
  pipeline.realize({3});
  EXPECT_EQ(events, 2);
}

// ---- expressions ----

TEST(Selects, OfFuncsAreExprs) {
  Func a("a"), b("b"), c("c"), two("two");
  Var x("x");
  a(x) = x;
  b(x) = 10 * x;
  c(x) = select(x > 2, a(x), b(x));
  two(x) = select(x == 0, a(x) + 7, x == 1, b(x), a(x));
  Buffer<int> r = c.realize({4}), t = two.realize({3});
  EXPECT_EQ(r(2), 20);
  EXPECT_EQ(r(3), 3);
  EXPECT_EQ(t(0), 7);
  EXPECT_EQ(t(1), 10);
  EXPECT_EQ(t(2), 2);
}

TEST(Selects, OfTuplesInBraces) {
  Func f("f");
  Var x("x");
  f(x) = tuple_select(x > 1, {x, 2.0f}, {-x, 3.0f});
  Realization r = f.realize({3});
  Buffer<int> first = r[0];
  Buffer<float> second = r[1];
  EXPECT_EQ(first(1), -1);
  EXPECT_EQ(second(2), 2.0f);
}

Expr u8_of(int value) { return cast<uint8_t>(value); }

TEST(Integers, SaturateHalveAndWiden) {
  EXPECT_EQ(evaluate<uint8_t>(saturating_add(u8_of(200), u8_of(100))), 255);
  EXPECT_EQ(evaluate<uint8_t>(saturating_sub(u8_of(100), u8_of(200))), 0);
  EXPECT_EQ(evaluate<uint8_t>(halving_add(u8_of(201), u8_of(100))), 150);
  EXPECT_EQ(evaluate<uint8_t>(rounding_halving_add(u8_of(201), u8_of(100))), 151);
  EXPECT_EQ(evaluate<uint8_t>(halving_sub(u8_of(100), u8_of(200))), static_cast<uint8_t>(-50));
  EXPECT_EQ(evaluate<uint16_t>(widening_add(u8_of(200), u8_of(100))), 300);
  EXPECT_EQ(evaluate<uint16_t>(widening_mul(u8_of(200), u8_of(100))), 20000);
  EXPECT_EQ(evaluate<int16_t>(widening_sub(u8_of(100), u8_of(200))), -100);
}

TEST(Integers, SaturatingSum) {
  RDom r(0, 20);
  Func f("f");
  Var x("x");
  f(x) = saturating_sum(cast<uint8_t>(r.x * x));
  Buffer<uint8_t> out = f.realize({3});
  EXPECT_EQ(out(1), 190);
  EXPECT_EQ(out(2), 255);
}

TEST(Integers, BitsTakenOutAndPutTogether) {
  const Expr word = Expr(0x12345678);
  EXPECT_EQ(evaluate<uint8_t>(extract_bits<uint8_t>(word, 8)), 0x56);
  EXPECT_EQ(evaluate<uint16_t>(extract_bits(UInt(16), word, 12)), 0x2345);
  EXPECT_EQ(evaluate<uint32_t>(concat_bits({u8_of(0x78), u8_of(0x56), u8_of(0x34), u8_of(0x12)})),
            0x12345678u);
  expect_error({"8, 16, 32 or 64 bits", "24"}, [] { concat_bits({u8_of(1), u8_of(2), u8_of(3)}); });
}

TEST(Casts, ToSixteenBitFloats) {
  using namespace ConciseCasts;
  EXPECT_EQ(static_cast<float>(evaluate<float16_t>(f16(Expr(1.0009766f)))), 1.0009766f);
  EXPECT_EQ(static_cast<float>(evaluate<bfloat16_t>(bf16(Expr(1.001f)))), 1.0f);
}

// ---- types ----

TEST(Types, WidenNarrowAndLimits) {
  EXPECT_EQ(UInt(8).widen(), UInt(16));
  EXPECT_EQ(Bool().widen(), UInt(8));
  EXPECT_EQ(Int(32, 4).narrow(), Int(16, 4));
  EXPECT_EQ(UInt(8).narrow(), Bool());
  EXPECT_TRUE(UInt(8).is_max(uint64_t{255}));
  EXPECT_TRUE(Int(8).is_min(int64_t{-128}));
  EXPECT_FALSE(Int(8).is_max(int64_t{-128}));
  EXPECT_TRUE(UInt(32).can_overflow());
  EXPECT_FALSE(Int(32).can_overflow());
  EXPECT_TRUE(Int(16).can_overflow_int());
  EXPECT_EQ(Type(Type::Int, 8, 1), Int(8));
  EXPECT_EQ(Type(halide_type_float, 32, 4), Float(32, 4));
  EXPECT_TRUE(Float(32).code() == halide_type_float);
}

TEST(Targets, SayTheirDevices) {
  const Target cuda("x86-64-linux-cuda-cuda_capability_61"), plain("x86-64-linux");
  EXPECT_EQ(cuda.get_required_device_api(), DeviceAPI::CUDA);
  EXPECT_EQ(cuda.get_cuda_capability_lower_bound(), 61);
  EXPECT_EQ(plain.get_required_device_api(), DeviceAPI::None);
  EXPECT_EQ(plain.get_cuda_capability_lower_bound(), 20);
  EXPECT_EQ(get_default_device_api_for_target(plain), DeviceAPI::Host);
}

// ---- loops that reuse names, as Halide allows ----

// f(x, y) = x + 10 * y under a schedule
template <typename Schedule>
void expect_same_values(Schedule&& schedule) {
  Func f("f");
  Var x("x"), y("y");
  f(x, y) = x + 10 * y;
  schedule(f);
  Buffer<int> out(85, 53);
  out.fill(-1);  // stale memory of an earlier run must not pass for a result
  f.realize(out);
  int wrong = 0;
  out.for_each_element([&](int i, int j) { wrong += out(i, j) != i + 10 * j; });
  EXPECT_EQ(wrong, 0) << "of " << 85 * 53;
}

TEST(LoopNames, AreFreeAgainWhenTheirLoopIsGone) {
  Var x("x"), y("y"), xo("xo"), xi("xi"), t("t");
  expect_same_values([&](Func f) { f.split(x, xo, xi, 8).split(xo, x, t, 4); });
  expect_same_values([&](Func f) { f.split(x, xo, xi, 8).split(xi, x, t, 4).vectorize(x); });
  expect_same_values([&](Func f) { f.split(x, xi, x, 8).vectorize(x); });
  expect_same_values([&](Func f) { f.split(x, xo, xi, 8).split(y, x, t, 4).parallel(x); });
  expect_same_values([&](Func f) { f.split(x, xo, xi, 8).split(y, y, x, 4).reorder(x, xi); });
  expect_same_values([&](Func f) { f.split(x, xo, xi, 8).rename(xo, x); });
  expect_same_values([&](Func f) { f.split(x, xo, xi, 8).fuse(xi, xo, x).vectorize(x, 4); });
  expect_same_values([&](Func f) { f.fuse(x, y, t).split(t, x, y, 4); });
  expect_same_values([&](Func f) { f.fuse(x, y, x); });
  expect_same_values([&](Func f) { f.fuse(x, y, y); });
  expect_same_values([&](Func f) { f.fuse(x, y, y).split(y, y, x, 4).vectorize(x); });
  expect_same_values([&](Func f) { f.rename(x, xo).rename(y, x).split(x, x, xi, 4); });
  expect_same_values(
      [&](Func f) { f.split(x, xo, xi, 8).split(y, x, t, 4).split(xo, y, xo, 2).vectorize(xi); });
}

TEST(LoopNames, OfLevelsMayHaveDots) {
  Func f("f"), g("g");
  Var x("x");
  RDom r(0, 5, "r");
  f(x) = x;
  g(x) = 0;
  g(x) += f(x + r.x);
  const LoopLevel level(g, r.x, 1);
  EXPECT_TRUE(level.var().is_rvar);
  EXPECT_EQ(level.var().name(), r.x.name());
  f.compute_at(g, level.var().rvar);
  Buffer<int> out = g.realize({3});
  EXPECT_EQ(out(1), 1 + 2 + 3 + 4 + 5);
}

// ---- a predicate that reads the Func that it guards ----

TEST(Predicates, MayReadWhatTheyGuard) {
  Var x("x");
  Func f("f");
  RDom r(0, 8);
  f(x) = x;
  r.where(f(r) > 2);
  f(r) = f(r) * 10 + r;
  Buffer<int> of_f = f.realize({8});
  for (int i = 0; i < 8; ++i) EXPECT_EQ(of_f(i), i > 2 ? 11 * i : i);
}

// ---- enumerations and targets as text ----

template <typename T>
std::string shown(const T& value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

TEST(Printing, ChoicesByTheirNames) {
  EXPECT_EQ(shown(TailStrategy::GuardWithIf), "GuardWithIf");
  EXPECT_EQ(shown(TailStrategy::Auto), "Auto");
  EXPECT_EQ(shown(MemoryType::Stack), "Stack");
  EXPECT_EQ(shown(MemoryType::GPUShared), "GPUShared");
  EXPECT_EQ(shown(DeviceAPI::CUDA), "CUDA");
  EXPECT_EQ(shown(DeviceAPI::Default_GPU), "Default_GPU");
  EXPECT_EQ(shown(LoopAlignStrategy::AlignEnd), "AlignEnd");
  EXPECT_EQ(shown(PrefetchBoundStrategy::NonFaulting), "NonFaulting");
  EXPECT_EQ(shown(Partition::Never), "Never");
  EXPECT_EQ(shown(Int(8).code()) + shown(UInt(1).code()) + shown(Handle().code()), "intuinthandle");
  EXPECT_EQ(shown(Float(16).code()) + shown(BFloat(16).code()), "floatbfloat");
}

TEST(Printing, TargetsAndLoopLevels) {
  EXPECT_EQ(shown(Target("x86-64-linux-avx2")), "target(x86-64-linux-avx2)");
  Var x("x");
  Func f("print_level");
  f(x) = x;
  EXPECT_EQ(shown(LoopLevel(f, x)), f.name() + ".x");
  EXPECT_EQ(shown(LoopLevel::root()), "root");
  EXPECT_EQ(shown(LoopLevel()), "undefined");
}

TEST(Evaluating, TuplesWhereADeviceMayHelp) {
  int whole = 0;
  float half = 0;
  evaluate_may_gpu(Tuple(Expr(3), Expr(2.5f)), &whole, &half);
  EXPECT_EQ(whole, 3);
  EXPECT_EQ(half, 2.5f);
}

// ---- pointers as values ----

class Pointers : public testing::Test {
 protected:
  Var x{"x"};
  const char* texts[4] = {"abc", "bc", "c", ""};
  Buffer<const char*> image{4};
  ImageParam in{Handle(), 1, "texts"};
  Pointers() {
    for (int i = 0; i < 4; i++) image(i) = texts[i];
    in.set(image);
  }
  void expect_reversed(Func f) {
    Buffer<const char*> found = f.realize({4});
    for (int i = 0; i < 4; i++) EXPECT_EQ(found(i), texts[3 - i]) << i;
  }
};

TEST_F(Pointers, OfParamsAndImagesAreValues) {
  Param<const char*> word("word");
  word.set(texts[0]);
  Func stored("stored"), shifted("shifted"), reversed("reversed");
  stored(x) = word;
  shifted(x) = stored(x + 1);
  stored.compute_root();
  Buffer<const char*> same = shifted.realize({3});
  EXPECT_EQ(same(2), texts[0]);
  reversed(x) = in(3 - x);
  expect_reversed(reversed);
}

TEST_F(Pointers, OfTextsAreValues) {
  Func text("text"), chosen("chosen"), copied("copied");
  text(x) = cast<const char*>(std::string("one text"));
  chosen(x) = select(x % 2 == 0, Expr(std::string("even")), Expr(std::string("odd")));
  copied(x) = Tuple(text(x), chosen(x));
  text.compute_root().vectorize(x, 4);
  chosen.compute_root().vectorize(x, 4).parallel(x);
  Realization both = copied.realize({20});
  Buffer<const char*> texts = both[0], choices = both[1];
  for (int i = 0; i < 20; i++) {
    EXPECT_STREQ(texts(i), "one text");
    EXPECT_EQ(texts(i), texts(0));
    EXPECT_STREQ(choices(i), i % 2 == 0 ? "even" : "odd");
  }
  EXPECT_EQ(reinterpret_cast<uintptr_t>(texts(0)) % 4, 0u);
}

TEST_F(Pointers, RunInVectorsAndThreads) {
  Func wide("wide"), apart("apart");
  wide(x) = in(3 - x);
  wide.vectorize(x, 4);
  expect_reversed(wide);
  apart(x) = in(3 - x);
  apart.parallel(x);
  expect_reversed(apart);
}

TEST_F(Pointers, AreChosenComparedAndReadAsNumbers) {
  Func last("last"), same("same"), number("number"), pair("pair");
  RDom r(0, 4);
  last() = in(0);
  last() = select(r > 1, in(r), last());
  Buffer<const char*> of_last = last.realize();
  EXPECT_EQ(of_last(), texts[3]);
  same(x) = in(x) == in(2) || in(x) != in(x);
  Buffer<bool> of_same = same.realize({4});
  for (int i = 0; i < 4; i++) EXPECT_EQ(of_same(i), i == 2) << i;
  number(x) = reinterpret<uint64_t>(in(x));
  Buffer<uint64_t> of_number = number.realize({4});
  EXPECT_EQ(of_number(1), reinterpret_cast<uint64_t>(texts[1]));
  pair(x) = Tuple(x, in(x));
  Realization both = pair.realize({4});
  EXPECT_EQ(Buffer<const char*>(both[1])(2), texts[2]);
}

// ---- copies ----

TEST(Copies, ToTheHostAreFuncsThatCopy) {
  Var x("x");
  Func f("f"), out("out");
  f(x) = 3 * x;
  out(x) = f(x) + f(x + 1);
  f.compute_root();
  f.in(out).copy_to_host().compute_root();
  Buffer<int> found = out.realize({8});
  for (int i = 0; i < 8; i++) EXPECT_EQ(found(i), 6 * i + 3);
}

TEST(Copies, ChangeNothing) {
  Var x("x");
  Func f("f"), moved("moved"), undefined("undefined");
  f(x) = 3 * x;
  moved(x) = f(x + 1);
  for (Func* other : {&moved, &f}) {
    expect_mentions(error_of<CompileError>([&] { other->copy_to_host(); }),
                    {"same values at the same coordinates"});
  }
  expect_mentions(error_of<CompileError>([&] { undefined.copy_to_host(); }),
                  {"it has no definition"});
}

// ---- unsupported uses ----

// rule: argument buffers lie in the memory of the CPU
// rule: storage lies in the memory of the CPU
TEST(Refusals, SayWhatIsNotThere) {
  Buffer<float> buffer(3);
  expect_error<Unsupported>({"copy_to_device", "devices are CUDA's"},
                            [&] { buffer.copy_to_device(DeviceAPI::Metal); });
  expect_error<CompileError>({"device_malloc", "a GPU must be named"},
                             [&] { buffer.device_malloc(DeviceAPI::Host); });
}

}  // namespace

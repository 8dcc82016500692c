// Features of targets, generators and calls under Halide's names, with their documented effects.
//
// Includes only Halide.h, which must bring everything that programs rely on.
#include "Halide.h"

#include <gtest/gtest.h>

#include "support/errors.h"
#include "support/loop_nest.h"
#include "support/temporary_folder.h"

using namespace Halide;
using retrograde::error_of;
using retrograde::expect_error;
using retrograde::expect_mentions;
using retrograde::reinterpret_bits;
using retrograde::Unsupported;
using retrograde::warnings_of;
using retrograde::WarningScope;

// A program may add to Halide's namespaces, as Halide's own extensions do.
namespace Halide {
namespace Internal {
struct Addition {
  int value = 7;
};
}  // namespace Internal
}  // namespace Halide

namespace {

TEST(Fma, RoundsOnceWhateverMayContract) {
  Var x("x");
  const float e = 0x1p-12f;
  Buffer<float> a(3);
  a(0) = 1 + e, a(1) = 1 - e, a(2) = 3;
  for (const bool strict : {false, true}) {
    Func f("f");
    Expr value = fma(a(x), a(x), -1);
    f(x) = strict ? strict_float(value) : value;
    const Buffer<float> found = f.realize({3});
    for (int i = 0; i < 3; ++i) EXPECT_EQ(found(i), std::fma(a(i), a(i), -1.0f)) << i << strict;
  }
}

TEST(HalideHeader, BringsWhatProgramsRelyOn) {
  std::mt19937 random(1);
  std::vector<float> values = {std::sqrt(4.0f), static_cast<float>(random() % 2)};
  std::sort(values.begin(), values.end());
  std::set<int> set = {3};
  std::queue<int> queue;
  std::list<int> list;
  std::stringstream stream;
  stream << values[1];
  char copy[4];
  std::memcpy(copy, stream.str().c_str(), stream.str().size() + 1);
  std::thread thread([&] { queue.push(static_cast<int>(set.size())); });
  thread.join();
  EXPECT_STREQ(copy, "2");
  EXPECT_EQ(queue.size(), 1u);
  EXPECT_TRUE(list.empty());
}

TEST(HalideHeader, InternalIsOneNamespace) {
  EXPECT_EQ(Internal::Addition().value, 7);
  EXPECT_EQ(Halide::Internal::reinterpret_bits<uint32_t>(1.0f), 0x3f800000u);
  EXPECT_EQ(reinterpret_bits<float>(uint32_t{0x40000000}), 2.0f);
  const Internal::GeneratorParamsMap none;
  EXPECT_TRUE(none.empty());
}

// ---- 16-bit floats ----

template <typename T>
void expect_fields(T value, int exponent, int mantissa) {
  const uint16_t bits = value.to_bits();
  EXPECT_EQ((bits & T::exponent_mask) >> T::mantissa_bits, exponent);
  EXPECT_EQ(bits & T::mantissa_mask, mantissa);
  EXPECT_EQ(T::sign_mask ^ T::exponent_mask ^ T::mantissa_mask, 0xffff);
}

TEST(SmallFloats, HaveTheirFields) {
  expect_fields(float16_t(1.5f), 15, 0x200);
  expect_fields(bfloat16_t(1.5f), 127, 0x40);
  EXPECT_EQ(float16_t(-1.5f).to_bits() & float16_t::sign_mask, 0x8000);
}

// ---- targets ----

TEST(Targets, SayWhomTheyAreTunedFor) {
  const Target tuned("x86-64-linux-avx2-tune_znver3-vector_bits_256");
  EXPECT_EQ(tuned.processor_tune, Target::Processor::ZnVer3);
  EXPECT_EQ(tuned.processor_name(), "znver3");
  EXPECT_EQ(tuned.vector_bits, 256);
  EXPECT_EQ(Target(tuned.to_string()), tuned);
  EXPECT_NE(Target("x86-64-linux-avx2"), tuned);
  EXPECT_EQ(Target().processor_tune, Target::ProcessorGeneric);
  EXPECT_FALSE(Target::validate_target_string("x86-64-linux-tune_abacus"));
  EXPECT_FALSE(Target::validate_target_string("x86-64-linux-vector_bits_"));
  EXPECT_FALSE(Target::validate_target_string("x86-64-linux-vector_bits_many"));
}

TEST(Targets, AreValidWhereAllIsKnown) {
  EXPECT_TRUE(Target::validate_target_string("x86-32-linux-sse41"));
  EXPECT_FALSE(Target::validate_target_string(Target().to_string()));
  EXPECT_TRUE(Target(Target().to_string()).has_unknowns()) << "it is read all the same";
}

TEST(Targets, ImplyFeatures) {
  Target target("x86-64-linux-avx512_skylake");
  target.set_implied_features();
  EXPECT_TRUE(target.features_all_of(
      {Target::AVX512, Target::AVX2, Target::FMA, Target::F16C, Target::AVX, Target::SSE41}));
  EXPECT_FALSE(target.has_feature(Target::AVX512_Cannonlake));
  target.unset_implied_features();
  EXPECT_EQ(target, Target("x86-64-linux-avx512_skylake"));
  Target bare("x86-64-linux-fma");
  bare.unset_implied_features();
  EXPECT_TRUE(bare.has_feature(Target::FMA));
}

TEST(Targets, NameTheLengthOfStreamingVectors) {
  EXPECT_EQ(Target::sme_svl_feature_from_bits(512), Target::SME_SVL512);
  EXPECT_EQ(Target::sme_svl_feature_from_bits(500), Target::FeatureEnd);
  EXPECT_EQ(Target("arm-64-linux-sme_svl1024").sme_streaming_vector_bits(), 1024);
  EXPECT_EQ(Target("arm-64-linux").sme_streaming_vector_bits(), 0);
  EXPECT_TRUE(Target("x86-64-linux-webgpu").supports_device_api(DeviceAPI::WebGPU));
}

TEST(Targets, RefuseSanitizersByName) {
  Func f("f");
  Var x("x");
  f(x) = x;
  const Target jit = get_jit_target_from_environment();
  for (const auto& [feature, name] : {std::pair{Target::MSAN, "\"msan\""},
                                      {Target::TSAN, "\"tsan\""},
                                      {Target::SanitizerCoverage, "\"sanitizer_coverage\""}}) {
    expect_error<Unsupported>(
        {name, "this sanitizer's checks", "Leave out"},
        [&, feature = feature] { f.realize({3}, jit.with_feature(feature)); });
  }
}

TEST(Targets, RefuseLargeBuffersByName) {
  Func f("f");
  Var x("x");
  f(x) = x;
  const Target large = get_jit_target_from_environment().with_feature(Target::LargeBuffers);
  EXPECT_EQ(large.unsupported_part(), "large_buffers");
  const std::initializer_list<std::string_view> words{"\"large_buffers\"",
                                                      "at most 2147483647 elements", "in tiles"};
  expect_error<Unsupported>(words, [&] { f.realize({3}, large); });
  const TemporaryFolder folder;
  expect_error<Unsupported>(words, [&] {
    f.compile_to_file((folder.path() / "f").string(), {}, "f",
                      Target("x86-64-linux-large_buffers"));
  });
}

// ---- Target::FuzzFloatStores ----

Target with(Target::Feature feature) {
  return get_jit_target_from_environment().with_feature(feature);
}

template <typename T>
void expect_even_bits(bool is_vectorized) {
  Func f("f");
  Var x("x");
  f(x) = cast<T>(1.0f) / cast<T>(x + 3);
  if (is_vectorized) f.vectorize(x, 4);
  Buffer<T> plain = f.realize({21}), fuzzed = f.realize({21}, with(Target::FuzzFloatStores));
  int odd = 0;
  for (int i = 0; i < 21; i++) {
    using Bits = std::conditional_t<sizeof(T) == 4, uint32_t, uint64_t>;
    const auto before = reinterpret_bits<Bits>(plain(i)), after = reinterpret_bits<Bits>(fuzzed(i));
    EXPECT_EQ(after, before & ~Bits{1}) << i;
    odd += before != after;
  }
  EXPECT_GT(odd, 0);
}

TEST(FuzzFloatStores, ClearsTheLastBit) {
  expect_even_bits<float>(false);
  expect_even_bits<float>(true);
  expect_even_bits<double>(true);
}

TEST(FuzzFloatStores, LeavesNaNsInfinitiesAndIntegersAlone) {
  Func f("f");
  Var x("x");
  const float lowest_nan = reinterpret_bits<float>(uint32_t{0x7f800001});
  f(x) = Tuple(mux(x, {Expr(lowest_nan), Expr(std::numeric_limits<float>::infinity())}), 2 * x + 1);
  const Realization r = f.realize({2}, with(Target::FuzzFloatStores));
  const Buffer<float> floats = r[0];
  const Buffer<int> whole = r[1];
  EXPECT_TRUE(std::isnan(floats(0)));
  EXPECT_TRUE(std::isinf(floats(1)));
  EXPECT_EQ(whole(1), 3);
}

// ---- Target::CheckUnsafePromises ----

TEST(CheckUnsafePromises, FailsWhereAPromiseIsBroken) {
  for (const bool is_vectorized : {false, true}) {
    Param<int> limit("limit");
    Func f("f"), g("g");
    Var x("x");
    f(x) = 3 * x;
    g(x) = f(unsafe_promise_clamped(x, 0, limit));
    f.compute_root().bound_extent(x, 64);
    if (is_vectorized) g.vectorize(x, 4);
    limit.set(9);
    Buffer<int> kept = g.realize({10}, with(Target::CheckUnsafePromises));
    EXPECT_EQ(kept(9), 27);
    limit.set(8);
    expect_error<RuntimeError>({"unsafe_promise_clamped", "between 0 and 8"},
                               [&] { g.realize({10}, with(Target::CheckUnsafePromises)); });
  }
}

// ---- user_context_value ----

struct Greeting : JITUserContext {
  int number = 0;
};

extern "C" __attribute__((visibility("default"))) int halide_features_number(void* context, int x) {
  return static_cast<Greeting*>(context)->number + x;
}
HalideExtern_2(int, halide_features_number, void*, int);

TEST(UserContext, IsAValueForCFunctions) {
  for (const bool is_parallel : {false, true}) {
    Func f("f");
    Var x("x");
    f(x) = halide_features_number(user_context_value(), x);
    if (is_parallel) f.vectorize(x, 4).parallel(x);
    Greeting first, second;
    first.number = 40;
    second.number = 50;
    Buffer<int> a = f.realize(&first, {9}), b = f.realize(&second, {9});
    for (int i = 0; i < 9; i++) {
      EXPECT_EQ(a(i), 40 + i);
      EXPECT_EQ(b(i), 50 + i);
    }
  }
}

extern "C" __attribute__((visibility("default"))) int halide_features_fill(void* context,
                                                                           halide_buffer_t* out) {
  if (!out->is_bounds_query()) {
    for (int i = 0; i < out->dim[0].extent; i++)
      reinterpret_cast<int32_t*>(out->host)[i] = static_cast<Greeting*>(context)->number;
  }
  return 0;
}

extern "C" __attribute__((visibility("default"))) int halide_features_add_one(
    halide_buffer_t* in, halide_buffer_t* out) {
  if (in->is_bounds_query()) in->dim[0] = out->dim[0];
  if (in->is_bounds_query() || out->is_bounds_query()) return 0;
  const Halide::Runtime::Buffer<int32_t> from(*in);
  Halide::Runtime::Buffer<int32_t> to(*out);
  to.for_each_element([&](int i) { to(i) = from(i) + 1; });
  return 0;
}

TEST(UserContext, IsAnArgumentOfExternStages) {
  Func f("f"), g("g");
  Var x("x");
  f.define_extern("halide_features_fill", {user_context_value()}, Int(32), 1);
  g(x) = f(x) + x;
  f.compute_root();
  Greeting greeting;
  greeting.number = 11;
  Buffer<int> out = g.realize(&greeting, {5});
  EXPECT_EQ(out(4), 15);
}

// ---- stages ----

TEST(Stages, ListTheirLoops) {
  Func f("f");
  Var x("x"), y("y"), xo("xo"), xi("xi");
  RDom r(0, 4, "r");
  f(x, y) = 0;
  f(x, y) += r;
  f.update().split(x, xo, xi, 8);
  const std::vector<VarOrRVar> vars = f.update().split_vars();
  ASSERT_GE(vars.size(), 4u);
  EXPECT_EQ(vars[0].name(), RVar(r.x).name());
  EXPECT_TRUE(vars[0].is_rvar);
  EXPECT_EQ(vars[1].name(), "xi");
  EXPECT_EQ(vars[2].name(), "xo");
  EXPECT_FALSE(vars[2].is_rvar);
}

TEST(Tails, BlendWhatWasThere) {
  for (const TailStrategy tail :
       {TailStrategy::RoundUpAndBlend, TailStrategy::ShiftInwardsAndBlend}) {
    Func f("f"), g("g");
    Var x("x");
    f(x) = x;
    f(x) = f(x) * 3 + 1;
    g(x) = f(x);
    f.compute_root().update().vectorize(x, 8, tail);
    Buffer<int> out = g.realize({21});
    for (int i = 0; i < 21; i++) EXPECT_EQ(out(i), 3 * i + 1);
  }
}

// ---- Parameter ----

TEST(Parameters, StandForParamsAndImages) {
  Param<int> p("p", 3);
  ImageParam image(Float(32), 2, "image");
  const Parameter of_p = p.parameter(), of_image = image.parameter();
  EXPECT_TRUE(of_p.defined() && !of_p.is_buffer() && of_image.is_buffer());
  EXPECT_EQ(of_p.name(), "p");
  EXPECT_EQ(of_image.dimensions(), 2);
  EXPECT_EQ(of_p.scalar<int>(), 3);
  Parameter(of_p).set_scalar(5);
  EXPECT_EQ(p.get(), 5);
  const Parameter made(Int(16), true, 3, "made");
  EXPECT_EQ(made.type(), Int(16));
  expect_error({"\"p\"", "it is a scalar"}, [&] { of_p.buffer(); });
  expect_error({"this is for scalars", "it is a buffer"}, [&] { of_image.scalar<float>(); });
  expect_error({"made without one"}, [] { Parameter().name(); });
  expect_error({"no dimensions"}, [] { Parameter(Int(8), false, 1); });
}

TEST(Parameters, OfScalarsHaveLimitsAndAnEstimate) {
  Param<int> p("p", 3);
  Func f("f");
  Var x("x");
  f(x) = p + x;
  Parameter of_p = p.parameter();
  of_p.set_min_value(2);
  of_p.set_max_value(4);
  of_p.set_estimate(3);
  EXPECT_EQ(retrograde::text(of_p.min_value(), of_p.max_value(), of_p.estimate()), "243");
  EXPECT_EQ(retrograde::text(of_p.scalar_expr()), "3");
  f.realize({3});
  of_p.set_scalar(5);
  expect_error<RuntimeError>({"\"p\"", "4"}, [&] { f.realize({3}); });
  EXPECT_TRUE(of_p.same_as(p.parameter()));
  const std::shared_ptr<retrograde::graph::ParameterContents> contents = of_p;
  EXPECT_EQ(contents, p.parameter());
}

TEST(Parameters, OfImagesHaveABufferAndConstraints) {
  ImageParam image(Float(32), 1, "image");
  Func f("f");
  Var x("x");
  f(x) = image(x) + 1.0f;
  Parameter parameter = image.parameter();
  Buffer<float> data(4);
  data.fill(2.0f);
  parameter.set_buffer(data);
  Buffer<float> out = f.realize({4});
  EXPECT_EQ(out(3), 3.0f);
  parameter.set_host_alignment(64);
  EXPECT_EQ(parameter.host_alignment(), 64);
  parameter.set_host_alignment(4);
  parameter.set_min_constraint(0, 0);
  parameter.set_stride_constraint(0, 1);
  parameter.set_extent_constraint(0, 5);
  expect_error<RuntimeError>({"\"image\"", "5"}, [&] { f.realize({4}); });
}

TEST(Serialization, SaysWhatIsThereInstead) {
  std::vector<uint8_t> bytes;
  std::map<std::string, Parameter> parameters;
  Func f("f");
  f() = 1;
  expect_error<Unsupported>({"serialize a Pipeline"},
                            [&] { serialize_pipeline(Pipeline(f), bytes); });
  expect_error<Unsupported>({"parameters of a Pipeline"},
                            [&] { parameters = deserialize_parameters(bytes); });
  expect_error<Unsupported>({"no form as bytes", "compile_to_static_library"},
                            [&] { deserialize_pipeline(bytes); });
}

// ---- warnings ----

TEST(Warnings, AreToldInTheirScope) {
  Func f("f");
  Var x("x");
  std::vector<std::string> told;
  f(x) = x;
  f(x) = 2 * x;
  f.realize({3});
  f.vectorize(x, 4);
  {
    WarningScope scope([&](const std::string& warning) { told.push_back(warning); });
    f.realize({3});
    f.realize({3});
  }
  ASSERT_EQ(told.size(), 2u) << "once for a compilation";
  expect_mentions(told[0], {"update 0 of \"f", "hides", "its first definition"});
  expect_mentions(told[1], {"update 0 of \"f", "has no schedule", "update(0)"});
  f.update().unscheduled();
  f.realize({3});
  EXPECT_EQ(told.size(), 2u) << "outside of the scope";
  EXPECT_EQ(warnings_of(Pipeline(f)).size(), 1u);
}

TEST(Warnings, AreOfWhatIsHardlyMeant) {
  Func f("f"), g("g"), h("h");
  Var x("x");
  RDom none(0, 0), r(0, 4);
  f(x) = x;
  f(x) += r * x;
  f.vectorize(x, 1);
  f.update().atomic();
  g(x) = f(x);
  g(x) += none.x;
  h(x) = g(x);
  h.specialize(Expr(true)).vectorize(x, 4);
  const std::vector<std::string> found = warnings_of(Pipeline(h));
  ASSERT_EQ(found.size(), 4u);
  expect_mentions(found[0], {"vectorizing \"x\"", "by 1"});
  expect_mentions(found[1], {"atomic()", "changes nothing"});
  expect_mentions(found[2], {"never runs", "is 0"});
  expect_mentions(found[3], {"specialization of \"h", "does not depend on the call"});
}

TEST(Warnings, NameBoundsOfWhatIsInlined) {
  Func f("bounded"), g("g");
  Var x("x");
  f(x) = x;
  f.bound(x, 0, 127);
  g(x) = f(x * x);
  g.bound(x, 0, 16);
  const std::vector<std::string> found = warnings_of(Pipeline(g));
  ASSERT_EQ(found.size(), 1u);
  expect_mentions(found[0], {"bounds of \"x\" of \"bounded", "changes nothing", "is inlined"});
  f.compute_root();
  EXPECT_TRUE(warnings_of(Pipeline(g)).empty());
}

TEST(Warnings, NameARequirementThatNeverHolds) {
  Func f("f"), g("g");
  Var x("x");
  Param<int> p("p");
  f(x) = require(Expr(1) + Expr(2) == 4, x, "three is not four");
  g(x) = f(x) + require(p > 0, x, "p is positive");
  const std::vector<std::string> found = warnings_of(Pipeline(g));
  ASSERT_EQ(found.size(), 1u);
  expect_mentions(found[0], {"\"f", "has a requirement that never holds", "is false"});
}

TEST(Warnings, NameFloatsThatTheTargetLacks) {
  Func f("f");
  Var x("x");
  f(x) = cast<uint8_t>(cast<float16_t>(x) / 3);
  std::vector<std::string> told;
  WarningScope scope([&](const std::string& warning) { told.push_back(warning); });
  f.compile_to_module({}, "f", Target("x86-64-linux"));
  ASSERT_EQ(told.size(), 1u);
  expect_mentions(told[0], {"performance note", "float16 by software", "no f16c"});
  f.compile_to_module({}, "f", Target("x86-64-linux-sse41-avx-f16c"));
  f.compile_to_module({}, "f", Target("arm-64-linux"));
  EXPECT_EQ(told.size(), 1u);
}

TEST(Warnings, SpareProgramsThatMeanWhatTheySay) {
  Func f("f"), g("g"), h("h");
  Var x("x"), y("y");
  RDom r(0, 4);
  f(x, y) = undef<int>();
  f(x, y) = x + y;  // everything: undef contributed nothing before
  g(x, y) = f(x, y);
  g(x, 3) = f(x, 3);  // one row
  g(x, y) += f(x, y);
  h(x, y) = g(x, y);
  h(x, 0) = 1;
  h(r, y) = r;
  EXPECT_TRUE(warnings_of(Pipeline(h)).empty());
}

// ---- generators ----

class Adder : public Halide::Generator<Adder> {
 public:
  GeneratorParam<int> amount{"amount", 1};
  Input<Buffer<int, 1>> in{"in"};
  Output<Buffer<int, 1>> out{"out"};
  void generate() {
    trace_pipeline();
    out(x) = in(x) + amount;
  }
  void schedule() {
    in.set_estimate(Halide::_0, 0, 100);
    out.set_estimates({{0, 100}});
  }
  Var x{"x"};
};

TEST(Generators, AreCallableInTheProcess) {
  const Target target = get_jit_target_from_environment();
  const Callable add = create_callable_from_generator(target, "features_adder", {{"amount", "5"}});
  Buffer<int> in(4), out(4);
  in.fill(7);
  EXPECT_EQ(add(in, out), 0);
  EXPECT_EQ(out(3), 12);
  const Callable plain = GeneratorContext(target).create<Adder>()->compile_to_callable();
  EXPECT_EQ(plain(in, out), 0);
  EXPECT_EQ(out(3), 8);
  expect_error({"\"no_such_generator\""}, [&] {
    create_callable_from_generator(GeneratorContext(target), "no_such_generator");
  });
}

int begun = 0;

TEST(Generators, TraceTheirPipelineFromGenerate) {
  auto adder = GeneratorContext(get_jit_target_from_environment()).create<Adder>();
  Buffer<int> in(4);
  in.fill(1);
  adder->apply(in);
  adder->get_pipeline().set_custom_trace([](void*, const halide_trace_event_t* event) {
    begun += event->event == halide_trace_begin_pipeline;
    return 1;
  });
  adder->realize({4});
  EXPECT_EQ(begun, 1);
}

TEST(Generators, HaveOutputsThatMayBeTakenBeforeTheyAreDefined) {
  auto adder = GeneratorContext(get_jit_target_from_environment()).create<Adder>();
  const Func taken = adder->out;
  Buffer<int> in(4);
  in.fill(1);
  adder->apply(in);
  Func user("user");
  Var x("x");
  user(x) = taken(x) * 2;
  Buffer<int> out = user.realize({4});
  EXPECT_EQ(out(0), 4);
}

TEST(Generators, EstimateImagesByTheNamesOfTheirArguments) {
  auto adder = GeneratorContext(Target("x86-64-linux")).create<Adder>();
  const Module module = adder->build_module("adder");
  const std::vector<Argument>& args = module.functions().back().args;
  ASSERT_EQ(args[0].argument_estimates.buffer_estimates.size(), 1u);
  EXPECT_EQ(retrograde::text(args[0].argument_estimates.buffer_estimates[0].extent), "100");
  EXPECT_TRUE(adder->get_pipeline().defined());
  expect_error({"an estimate of \"q\"", "\"_0\""}, [&] { adder->in.set_estimate(Var("q"), 0, 3); });
}

template <typename T, int Factor>
class Times : public Halide::Generator<Times<T, Factor>> {
  using Base = Halide::Generator<Times<T, Factor>>;

 public:
  template <typename T2>
  using Input = typename Base::template Input<T2>;
  template <typename T2>
  using Output = typename Base::template Output<T2>;
  Input<Halide::Buffer<T>> in{"in", 1};
  Output<Halide::Buffer<T>> out{"out", 1};
  Halide::Var x{"x"};
  void generate() { out(x) = in(x)*Halide::cast<T>(Factor); }
};

TEST(Generators, MayBeTemplates) {
  const Target target = get_jit_target_from_environment();
  Buffer<int16_t> in(4), out(4);
  in.fill(3);
  EXPECT_EQ(create_callable_from_generator(target, "features_times_3")(in, out), 0);
  EXPECT_EQ(out(0), 9);
}

class Inner : public Halide::Generator<Inner> {
 public:
  GeneratorParam<LoopLevel> level{"level", LoopLevel::root()};
  Input<Func> in{"in", Int(32), 1};
  Output<Func> out{"out", Int(32), 1};
  void generate() {
    middle(x) = in(x) + in(x + 1);
    out(x) = middle(x) * middle(x + 1);
    middle.compute_at(level);
  }
  Var x{"x"};
  Func middle{"middle"};
};

TEST(Generators, TakeLoopLevelsAfterTheyHaveRun) {
  auto inner = GeneratorContext(get_jit_target_from_environment()).create<Inner>();
  Func source("source"), user("user");
  Var x("x"), y("y");
  source(x) = x;
  inner->apply(source);
  user(x, y) = inner->out(x) + y;
  inner->level.set({user, y});
  Buffer<int> out = user.realize({6, 2});
  EXPECT_EQ(out(2, 1), 5 * 7 + 1);
  EXPECT_EQ(retrograde::loops_around(user.loop_nest(), "middle"), std::vector<std::string>{"y"});
}

// Two C functions in one generator: one reads its image, the other a Func or the result of the
// first.
class Externs : public Halide::Generator<Externs> {
 public:
  Input<Buffer<int, 1>> image{"image"};
  Input<Func> func{"func", Int(32), 1};
  Output<Buffer<int, 1>> out{"out"};
  void generate() {
    Func once("once"), twice("twice"), other("other");
    const std::vector<ExternFuncArgument> of_image{image}, of_once{once}, of_func{func};
    once.define_extern("halide_features_add_one", of_image, Int(32), 1);
    twice.define_extern("halide_features_add_one", of_once, Int(32), 1);
    other.define_extern("halide_features_add_one", of_func, Int(32), 1);
    out(x) = 10000 * once(x) + 100 * twice(x) + other(x);
    for (Func f : {once, twice, other}) f.compute_root();
  }
  Var x{"x"};
};

TEST(Generators, HaveSeveralExternStages) {
  Func source("source");
  Var x("x");
  source(x) = x;
  source.compute_root();
  Buffer<int> image(5);
  image.fill(6);
  auto externs = GeneratorContext(get_jit_target_from_environment()).create<Externs>();
  externs->apply(image, source);
  Buffer<int> out = externs->realize({5});
  for (int i = 0; i < 5; i++) EXPECT_EQ(out(i), 70801 + i);
}

}  // namespace

using FeaturesTimes3 = Times<int16_t, 3>;
HALIDE_REGISTER_GENERATOR(Adder, features_adder)
HALIDE_REGISTER_GENERATOR((Times<int16_t, 3>), features_times_3)
HALIDE_REGISTER_GENERATOR(FeaturesTimes3, features_times_alias)

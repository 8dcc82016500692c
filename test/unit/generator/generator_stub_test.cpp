// A generator inside another one, through the header that it writes (-e cpp_stub). The build makes
// the header; values are compared with plain C++.
#include <gtest/gtest.h>

#include <algorithm>

#include "Halide.h"
#include "stub_configured.stub.h"
#include "stub_inner.schedule.h"
#include "stub_inner.stub.h"
#include "support/loop_nest.h"

using namespace Halide;
using test::inner::Enum_shape;
using test::inner::InnerStub;

namespace {

class Outer : public Halide::Generator<Outer> {
 public:
  Input<Buffer<int, 1>> input{"input"};
  Output<Buffer<int, 1>> output{"output"};
  void generate() {
    Func source("source"), other("other");
    source(x) = input(x) + 1;
    other(x) = 10 * x;
    InnerStub::GeneratorParams params;
    params.factor = 3;
    params.negate = true;
    params.open_type = UInt(8);
    params.level.set(LoopLevel(output, x));
    const auto inner = InnerStub::generate(this, {source, input, {source, other}, 4}, params);
    output(x) = inner.scaled(x) + inner.pair[1](x) + cast<int>(inner.open(x));
  }

 private:
  Var x{"x"};
};

TEST(GeneratorStub, ComputesInsideAnotherGenerator) {
  const GeneratorContext context(get_jit_target_from_environment());
  Buffer<int> input(8);
  input.for_each_element([&](int i) { input(i) = i * i; });
  auto outer = context.create<Outer>();
  outer->apply(input);
  Buffer<int> output = outer->realize({8});
  for (int i = 0; i < 8; i++) {
    const int source = i * i + 1;
    EXPECT_EQ(output(i), -(3 * source + 4) + (10 * i + 2) + source) << i;
  }
}

TEST(GeneratorStub, HasParamsWithTheirDefaults) {
  const InnerStub::GeneratorParams params;
  EXPECT_EQ(params.factor, 2);
  EXPECT_EQ(params.bias, 0.5f);
  EXPECT_FALSE(params.negate);
  EXPECT_EQ(params.word, "a \"word\"");
  EXPECT_EQ(params.shape, Enum_shape::ramp);
  EXPECT_EQ(params.type, Int(32));
  EXPECT_TRUE(params.level.is_root());
}

TEST(GeneratorStub, HasEachNameOnce) {
  InnerStub::GeneratorParams params;
  EXPECT_EQ(params.scaled_type, Int(32));  // the param
  EXPECT_EQ(params.scaled_type_, Type());  // unset, because the declaration leaves it open
  params.scaled_type_ = Int(16);
  const auto map = params.to_generator_params_map();
  EXPECT_EQ(map.at("scaled.type").text, "int16");
  EXPECT_EQ(map.at("scaled_type").text, "int32");
}

TEST(GeneratorStub, GivesImagesThatCanBeRealized) {
  Func source("source");
  Var x("x");
  source(x) = x;
  Buffer<int> image(4);
  image.fill(3);
  InnerStub::Inputs inputs;
  inputs.source = source;
  inputs.image = image;
  inputs.many = {source, source};
  inputs.offset = 0;
  InnerStub::GeneratorParams params;
  params.shape = Enum_shape::square;
  params.open_type = Int(16);
  const auto inner = InnerStub::generate(get_jit_target_from_environment(), inputs, params);
  Func of_shape = inner.shaped;
  Buffer<float> shaped = of_shape.realize({4});
  EXPECT_EQ(shaped(2), 9.5f);
  Realization all = inner.realize({4});
  EXPECT_EQ(all.size(), 5u);
  Buffer<int16_t> open = all[4];
  EXPECT_EQ(open(3), 3);
  EXPECT_TRUE(inner.target.has_feature(Target::JIT) || !inner.target.has_unknowns());
}

TEST(GeneratorStub, HasWhatConfigureAddsAndIsItsOnlyOutput) {
  const Target target = get_jit_target_from_environment();
  Func f = stub_configured::generate(target, {4, 10});
  Buffer<int> values = f.realize({3});
  EXPECT_EQ(values(2), 2 * 10 + 4);
}

// api: GeneratorBase::emit_schedule
// stub_inner.schedule.h (-e schedule), applied to the same Funcs without a schedule.
TEST(GeneratorSchedule, AppliesToFreshFuncs) {
  const GeneratorContext context(get_jit_target_from_environment());
  const auto make = [&] {
    auto inner = Internal::GeneratorRegistry::create("stub_inner", context);
    inner->set_generator_param_values({{"many.size", "2"}, {"open.type", "uint8"}});
    inner->generate_all();
    return inner->get_pipeline();
  };
  Pipeline plain = make(), scheduled = make();
  apply_schedule_stub_inner(scheduled, context.get_target());
  EXPECT_GT(scheduled.schedule_log().size(), 0u);
  const auto times_produced = [](Pipeline& pipeline) {
    return std::ranges::count(retrograde::names_in_nest(pipeline.loop_nest(), "produce"),
                              "partial");
  };
  EXPECT_EQ(times_produced(plain), 0);
  EXPECT_EQ(times_produced(scheduled), 1);
}

TEST(GeneratorStub, RefusesWhatDoesNotFit) {
  Func floats("floats");
  Var x("x");
  floats(x) = 1.0f;
  Buffer<int> image(4);
  EXPECT_THROW(
      InnerStub::generate(get_jit_target_from_environment(), {floats, image, {floats, floats}, 0}),
      CompileError);
}

}  // namespace

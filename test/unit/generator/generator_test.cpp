// Generators used from C++ and as modules.
#include "generator/generator.h"

#include <gtest/gtest.h>

#include "retrograde/retrograde.h"
#include "support/errors.h"
#include "support/loop_nest.h"

using namespace retrograde;

namespace {

enum class Edge { Clamp, Zero };

class BoxBlur : public Generator<BoxBlur> {
 public:
  GeneratorParam<int> radius{"radius", 1, 0, 8};
  GeneratorParam<float> weight{"weight", 1.0f};
  GeneratorParam<Edge> edge{"edge", Edge::Clamp, {{"clamp", Edge::Clamp}, {"zero", Edge::Zero}}};
  GeneratorParam<bool> vectorize{"vectorize", true};
  Input<Buffer<float, 1>> in{"in"};
  Input<float> gain{"gain", 1.0f, 0.0f, 100.0f};
  Output<Buffer<float, 1>> out{"out"};

  void generate() {
    Func source = edge == Edge::Clamp ? BoundaryConditions::repeat_edge(in)
                                      : BoundaryConditions::constant_exterior(in, 0.0f);
    RDom r(-radius, 2 * radius + 1);
    out(x) = 0.0f;
    out(x) += source(x + r) * gain * weight;
  }
  void schedule() {
    if (vectorize) out.vectorize(x, natural_vector_size<float>());
  }

 private:
  Var x{"x"};
};

Buffer<float> ramp(int n) {
  Buffer<float> result(n);
  for (int i = 0; i < n; i++) result(i) = static_cast<float>(i * i % 7);
  return result;
}

float at(const Buffer<float>& in, int i) { return in(std::min(std::max(i, 0), in.width() - 1)); }

TEST(Generator, RunsFromCpp) {
  const GeneratorContext context(get_jit_target_from_environment());
  auto blur = context.create<BoxBlur>();
  blur->radius.set(2);
  blur->weight.set(0.5f);
  const Buffer<float> in = ramp(50);
  blur->apply(in, 3.0f);
  const Buffer<float> out = blur->realize({50});
  for (int i = 0; i < 50; i++) {
    float sum = 0.0f;
    for (int r = -2; r <= 2; r++) sum += at(in, i + r) * 3.0f * 0.5f;
    ASSERT_EQ(out(i), sum) << i;
  }
  // The output is an ordinary Func.
  Func doubled("doubled");
  Var x;
  doubled(x) = 2.0f * blur->out(x);
  const Buffer<float> twice = doubled.realize({50});
  EXPECT_EQ(twice(20), 2.0f * out(20));
}

class Leveled : public Generator<Leveled> {
 public:
  GeneratorParam<LoopLevel> level{"level", LoopLevel::root()};
  Output<Buffer<int, 2>> out{"out"};
  Var x{"x"}, y{"y"};
  Func inner{"inner"};

  void generate() {
    inner(x, y) = x + y;
    out(x, y) = inner(x, y) * 2;
  }
  void schedule() { inner.compute_at(level); }
};

// The loops of an output exist only after generate() has run.
TEST(Generator, LoopLevelsAreSetBeforeAndAfterGenerate) {
  const GeneratorContext context(get_jit_target_from_environment());
  auto early = context.create<Leveled>(), late = context.create<Leveled>();
  Func other("other");
  early->level.set({other, early->y});
  early->apply();
  early->level.set({early->out, early->y});
  EXPECT_EQ(loops_around(Func(early->out).loop_nest(), "inner"), std::vector<std::string>{"y"});
  late->apply();
  late->level.set({late->out, late->x});
  EXPECT_EQ(loops_around(Func(late->out).loop_nest(), "inner"),
            (std::vector<std::string>{"y", "x"}));
  const Buffer<int> values = late->realize({4, 3});
  EXPECT_EQ(values(3, 2), 10);
}

TEST(Generator, ParamsComeAsText) {
  const GeneratorContext context(get_jit_target_from_environment());
  auto blur = context.create<BoxBlur>();
  blur->set_generator_param_values(
      {{"radius", "0"}, {"weight", "0.25"}, {"edge", "zero"}, {"vectorize", "false"}});
  EXPECT_EQ(blur->radius, 0);
  EXPECT_EQ(blur->weight, 0.25f);
  EXPECT_EQ(blur->edge, Edge::Zero);
  EXPECT_EQ(blur->edge.to_string(), "zero");
  EXPECT_FALSE(blur->vectorize);
  blur->apply(ramp(9), 4.0f);
  const Buffer<float> out = blur->out.realize({9});
  for (int i = 0; i < 9; i++) EXPECT_EQ(out(i), ramp(9)(i));
}

TEST(Generator, ParamsStandForTheirValuesInArithmetic) {
  GeneratorParam<int> a{"a", 7}, b{"b", 2};
  GeneratorParam<float> f{"f", 0.5f};
  EXPECT_EQ(a + 1, 8);
  EXPECT_EQ(1 - a, -6);
  EXPECT_EQ(a * b, 14);
  EXPECT_EQ(-a, -7);
  EXPECT_TRUE(a > b && a != 3 && !(a < 3));
  EXPECT_EQ(min(a, 3), 3);
  EXPECT_EQ(max(a, b), 7);
  EXPECT_EQ(f * 3, 1.5f);
  Func g("g");
  Var x;
  g(x) = x * a + cast<int>(f * 2.0f) + Expr(b);
  const Buffer<int> out = g.realize({4});
  EXPECT_EQ(out(3), 3 * 7 + 1 + 2);
  EXPECT_EQ(evaluate<int>(lambda(x, x + 1)(a)), 8);
}

// Arrays, scalars of unspecified type, images of unspecified type and dimensions, a Tuple output,
// an output without dimensions.
class Mixed : public Generator<Mixed> {
 public:
  Input<Buffer<int32_t>[3]> images { "images", 1 };
  Input<Func[]> funcs{"funcs", Int(32), 1};
  Input<int32_t[2]> factors{"factors", 1};
  Input<Expr> offset{"offset"};
  Output<Func> sums{"sums", 1};
  Output<int32_t> count{"count"};
  Output<Func[]> copies{"copies", 1};

  void configure() {
    offset.set_type(Int(16));
    sums.set_type({Int(32), Int(64)});
  }
  void generate() {
    Expr sum = cast<int32_t>(offset);
    for (const ImageParam& image : images) sum += image(x) * factors[0];
    for (size_t i = 0; i < funcs.size(); i++) sum += funcs[i](x) * factors[1];
    sums(x) = Tuple(sum, cast<int64_t>(sum) * 2);
    count() = static_cast<int32_t>(funcs.size());
    copies.resize(2);
    for (size_t i = 0; i < copies.size(); i++) copies[i](x) = images[i](x) + 1;
  }

 private:
  Var x{"x"};
};

TEST(Generator, TakesArraysFuncsAndOpenTypes) {
  const GeneratorContext context(get_jit_target_from_environment());
  Buffer<int32_t> a(5), b(5), c(5);
  for (int i = 0; i < 5; i++) a(i) = i, b(i) = 10 * i, c(i) = 100 * i;
  Var x;
  const auto mixed = context.apply<Mixed>(std::vector<Buffer<int32_t>>{a, b, c},
                                          std::vector<Func>{lambda(x, x), lambda(x, x * x)},
                                          std::vector<int>{2, 3}, cast<int16_t>(7));
  const Realization sums = mixed->sums.realize({5});
  const Buffer<int32_t> first = sums[0].as<int32_t>();
  const Buffer<int64_t> second = sums[1].as<int64_t>();
  for (int i = 0; i < 5; i++) {
    EXPECT_EQ(first(i), 7 + 111 * i * 2 + (i + i * i) * 3);
    EXPECT_EQ(second(i), 2 * first(i));
  }
  const Buffer<int32_t> count = mixed->count.realize();
  EXPECT_EQ(count(), 2);
  const Buffer<int32_t> copied = mixed->copies[1].realize({5});
  EXPECT_EQ(copied(4), 41);
}

class Sum : public Generator<Sum> {
 public:
  GeneratorParam<int> inputs{"inputs", 2, 1, 9};
  Output<Buffer<float, 1>> out{"out"};
  void configure() {
    for (int i = 0; i < inputs; i++)
      extra_.push_back(add_input<Buffer<float>>("in_" + std::to_string(i), 1));
    scale_ = add_input<float>("scale");
    largest_ = add_output<Buffer<float>>("largest", Float(32), 1);
  }
  void generate() {
    Expr sum = 0.0f, most = (*extra_[0])(x);
    for (auto* in : extra_) sum += (*in)(x), most = max(most, (*in)(x));
    out(x) = sum * *scale_;
    (*largest_)(x) = most;
  }

 private:
  Var x{"x"};
  std::vector<GeneratorInput<Buffer<float>>*> extra_;
  GeneratorInput<float>* scale_ = nullptr;
  GeneratorOutput<Buffer<float>>* largest_ = nullptr;
};

TEST(Generator, ConfigureAddsInputsAndOutputs) {
  auto sum = GeneratorContext(get_jit_target_from_environment()).create<Sum>();
  sum->inputs.set(3);
  sum->apply(ramp(6), ramp(6), ramp(6), 2.0f);
  const Realization both = sum->realize({6});
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0].as<float>()(5), 6.0f * ramp(6)(5));
  EXPECT_EQ(both[1].as<float>()(5), ramp(6)(5));
}

std::vector<std::string> argument_names(const Module& module) {
  std::vector<std::string> names;
  const auto declared = module.get_metadata_name_map();
  for (const Argument& argument : module.functions().back().args) {
    const auto found = declared.find(argument.name);
    names.push_back(found == declared.end() ? argument.name : found->second);
  }
  return names;
}

// Names that a generator uses without a using directive, inputs as arguments of a C function, and
// outputs of several types.
class Outside : public retrograde::Generator<Outside> {
 public:
  Input<Buffer<int32_t, 1>> image{"image"};
  Input<Func> func{"func", Int(32), 1};
  Input<int> factor{"factor", 3};
  Input<float[2]> more{"more"};
  Output<Func> both{"both", {Int(32), Float(32)}, 1};
  Output<Buffer<>> open{"open", {Int(32), UInt(8)}, 1};
  Output<Func[]> many{2, "many", {UInt(8), Int(16)}, 1};
  Output<Func> any{"any", 1};
  void configure() { extra_ = add_output<Func>("extra", {Int(32), Float(32)}, 1); }
  void generate() {
    stage_.define_extern("generator_test_sum", {image, func, factor, more[0]}, Int(32), 1,
                         NameMangling::C);
    const std::vector<ExternFuncArgument> arguments = {factor, image};
    EXPECT_TRUE(arguments[0].is_expr());
    both(x) = Tuple(stage_(x), more[1] * 2);
    open(x) = Tuple(x, cast<uint8_t>(x));
    many[0](x) = Tuple(cast<uint8_t>(x), cast<int16_t>(x));
    many[1](x) = many[0](x);
    any(x) = Tuple(x, x > 2);
    (*extra_)(x) = Tuple(x, 0.5f);
    EvictionKey key;
    PrefetchBoundStrategy bound = PrefetchBoundStrategy::Clamp;
    (void)key, (void)bound;
  }
  void schedule() { stage_.compute_root(); }

 private:
  Var x{"x"};
  Func stage_{"stage"};
  GeneratorOutput<Func>* extra_ = nullptr;
};

extern "C" int generator_test_sum(halide_buffer_t* image, halide_buffer_t* func, int factor,
                                  float more, halide_buffer_t* out) {
  const auto at = [](const halide_buffer_t* b, int i) {
    return reinterpret_cast<int32_t*>(b->host)[i - b->dim[0].min];
  };
  for (halide_buffer_t* input : {image, func}) {
    if (input->is_bounds_query()) input->dim[0] = out->dim[0];
  }
  if (image->is_bounds_query() || func->is_bounds_query() || out->is_bounds_query()) return 0;
  for (int i = out->dim[0].min; i < out->dim[0].min + out->dim[0].extent; i++) {
    reinterpret_cast<int32_t*>(out->host)[i - out->dim[0].min] =
        at(image, i) + at(func, i) * factor + static_cast<int>(more);
  }
  return 0;
}

TEST(Generator, InputsAreArgumentsOfCFunctions) {
  auto outside = GeneratorContext(get_jit_target_from_environment()).create<Outside>();
  outside->any.set_types({Int(32), Bool()});
  Buffer<int32_t> image(5);
  for (int i = 0; i < 5; i++) image(i) = 100 * i;
  Func func("func");
  Var x;
  func(x) = x;
  func.compute_root();
  outside->apply(image, func, 2, std::vector<float>{7.0f, 1.5f});
  const Realization all = outside->realize({5});
  ASSERT_EQ(all.size(), 12u);
  EXPECT_EQ(all[0].as<int32_t>()(4), 400 + 8 + 7);
  EXPECT_EQ(all[1].as<float>()(4), 3.0f);
  EXPECT_EQ(all[3].as<uint8_t>()(3), 3);
  EXPECT_EQ(all[7].as<int16_t>()(3), 3);
  EXPECT_EQ(all[9].as<bool>()(3), true);
  EXPECT_EQ(all[11].as<float>()(3), 0.5f);
}

TEST(Generator, OutputsOfSeveralTypesAreDeclaredAsText) {
  auto outside = GeneratorContext(Target("x86-64-linux")).create<Outside>();
  outside->set_generator_param_values({{"any.type", "int32,bool"}});
  const Module module = outside->build_module("outside");
  EXPECT_EQ(argument_names(module)[5], "both.0");
  EXPECT_EQ(argument_names(module).size(), 5 + 12u);
}

// A generator that uses another one.
class Twice : public Generator<Twice> {
 public:
  Input<Buffer<float, 1>> in{"in"};
  Output<Buffer<float, 1>> out{"out"};
  void generate() {
    auto blur = create<BoxBlur>();
    blur->radius.set(1);
    blur->apply(in, 1.0f);
    Var x;
    Func twice("twice");
    twice(x) = 2.0f * blur->out(x);
    out = twice;
  }
};

TEST(Generator, UsesAnother) {
  auto twice = GeneratorContext(get_jit_target_from_environment()).create<Twice>();
  const Buffer<float> in = ramp(20);
  twice->apply(in);
  const Buffer<float> out = twice->realize({20});
  EXPECT_EQ(out(5), 2.0f * (in(4) + in(5) + in(6)));
}

using Names = std::vector<std::string>;

TEST(Generator, ModulesTakeInputsAndThenOutputs) {
  const GeneratorContext context(Target("x86-64-linux"));
  EXPECT_EQ(argument_names(context.create<BoxBlur>()->build_module("blur")),
            (Names{"in", "gain", "out"}));
  // Another generator in this process has the same names.
  EXPECT_EQ(argument_names(context.create<BoxBlur>()->build_module("blur")),
            (Names{"in", "gain", "out"}));
  auto mixed = context.create<Mixed>();
  mixed->set_generator_param_values({{"funcs.size", "1"}});
  EXPECT_EQ(argument_names(mixed->build_module("mixed")),
            (Names{"images_0", "images_1", "images_2", "funcs_0", "factors_0", "factors_1",
                   "offset", "sums.0", "sums.1", "count", "copies_0", "copies_1"}));
}

// Properties that a declaration leaves open are known once the output is defined.
class Late : public Generator<Late> {
 public:
  Output<Func> late{"late"};
  void generate() {
    late(x, y) = Tuple(cast<uint8_t>(x), y);
    types = late.types();
    dimensions = late.dimensions();
  }
  std::vector<Type> types;
  int dimensions = 0;

 private:
  Var x{"x"}, y{"y"};
};

TEST(Generator, OutputsKnowTheTypesOfTheirDefinitions) {
  auto late = GeneratorContext(get_host_target()).create<Late>();
  EXPECT_THROW(late->late.types(), CompileError) << "nothing has said them";
  late->apply();
  EXPECT_EQ(late->types, (std::vector<Type>{UInt(8), Int(32)}));
  EXPECT_EQ(late->dimensions, 2);
}

// out = in * in * w + table: every image gets a gradient, scalars do not.
class Square : public Generator<Square> {
 public:
  Input<Buffer<float, 1>> in{"in"};
  Input<Buffer<uint8_t, 1>> table{"table"};
  Input<Buffer<double, 2>> unused{"unused"};
  Input<float> w{"w"};
  Output<Buffer<float, 1>> out{"out"};
  void generate() { out(x) = in(x)*in(x)*w + table(x); }
  void schedule() { scheduled = true; }
  bool scheduled = false;

 private:
  Var x{"x"};
};

TEST(Generator, GradientModuleHasHalidesArguments) {
  auto square = GeneratorContext(Target("x86-64-linux")).create<Square>();
  const Module module = square->build_gradient_module("square_grad");
  EXPECT_EQ(argument_names(module),
            (Names{"in", "table", "unused", "w", "_grad_loss_for_out", "_grad_loss_out_wrt_in",
                   "_grad_loss_out_wrt_table", "_dummy_grad_loss_out_wrt_unused"}));
  const std::vector<Argument>& args = module.functions().back().args;
  EXPECT_EQ(args[5].type, Float(32));
  EXPECT_EQ(args[6].type, UInt(8));
  EXPECT_EQ(args[7].type, Float(32)) << "of the seed's type: it is not read";
  EXPECT_EQ(args[7].dimensions, 2);
  EXPECT_FALSE(square->scheduled);
}

// Outputs of several types: each float output gets a gradient of its own type; integers have none.
class Several : public Generator<Several> {
 public:
  Input<Buffer<float, 1>> in{"in"};
  Output<Buffer<float, 1>> square{"square"};
  Output<Buffer<int, 1>> whole{"whole"};
  Output<Buffer<double, 1>> twice{"twice"};
  void generate() {
    square(x) = in(x)*in(x);
    whole(x) = cast<int>(in(x));
    twice(x) = 2.0 * cast<double>(in(x));
  }

 private:
  Var x{"x"};
};

TEST(Generator, GradientModuleTakesOutputsOfSeveralTypes) {
  auto several = GeneratorContext(Target("x86-64-linux")).create<Several>();
  const Module module = several->build_gradient_module("several_grad");
  EXPECT_EQ(argument_names(module), (Names{"in", "_grad_loss_for_square", "_grad_loss_for_whole",
                                           "_grad_loss_for_twice", "_grad_loss_square_wrt_in",
                                           "_grad_loss_whole_wrt_in", "_grad_loss_twice_wrt_in"}));
  const std::vector<Argument>& args = module.functions().back().args;
  EXPECT_EQ(args[2].type, Float(32)) << "a gradient at integers";
  EXPECT_EQ(args[3].type, Float(64));
  for (int i : {4, 5, 6}) EXPECT_EQ(args[i].type, Float(32)) << "of the input's type";
}

TEST(Generator, SeparateGradientsAreOfEachInputOfFloatsAndOfAll) {
  const GeneratorContext context(Target("x86-64-linux"));
  const Module module = context.create<Square>()->build_separate_gradients("g");
  const auto declared = module.get_metadata_name_map();
  Names functions;
  std::vector<Names> gradients;
  for (const auto& function : module.functions()) {
    functions.push_back(function.name);
    gradients.emplace_back();
    for (const Argument& argument : function.args) {
      const auto found = declared.find(argument.name);
      const std::string name = found == declared.end() ? argument.name : found->second;
      if (argument.is_output()) gradients.back().push_back(name);
    }
  }
  EXPECT_EQ(functions, (Names{"g", "g_by_in", "g_by_unused", "g_by_w"}));
  const std::string by = "_grad_loss_wrt_";
  EXPECT_EQ(gradients,
            (std::vector<Names>{
                {by + "in", by + "unused", by + "w"}, {by + "in"}, {by + "unused"}, {by + "w"}}));
  const Argument& of_number = module.functions().back().args.back();
  EXPECT_EQ(of_number.dimensions, 0);
  EXPECT_EQ(of_number.type, Float(32));
  EXPECT_EQ(argument_names(module),
            (Names{"in", "table", "unused", "w", "_grad_loss_for_out", "_grad_loss_wrt_w"}));

  // A single input gives one function; only float outputs have seeds.
  const Module alone = context.create<Several>()->build_separate_gradients("several");
  EXPECT_EQ(alone.functions().size(), 1u);
  EXPECT_EQ(argument_names(alone),
            (Names{"in", "_grad_loss_for_square", "_grad_loss_for_twice", "_grad_loss_wrt_in"}));
}

TEST(Generator, AutoScheduleRunsTheSchedulerItNames) {
  std::vector<std::string> scheduled;
  Pipeline::add_autoscheduler(
      "ByRows", [&](const Pipeline& pipeline, const Target&, const MachineParams& machine,
                    AutoSchedulerResults* results) {
        for (Func& output : pipeline.outputs()) scheduled.push_back(output.name());
        results->schedule_source = "rows";
        EXPECT_EQ(machine.parallelism, 2);
      });
  const GeneratorContext context(Target("x86-64-linux"));
  auto sum = context.create<Sum>();
  sum->set_generator_param_values(
      {{"auto_schedule", "ByRows"}, {"machine_params", "2,1000000,20"}});
  EXPECT_TRUE(sum->using_autoscheduler());
  sum->build_module("sum");
  EXPECT_EQ(scheduled.size(), 2u);
  Pipeline::add_autoscheduler("ByRows", nullptr);
}

TEST(Generator, AutoScheduleNeedsNoPlugin) {
  const GeneratorContext context(Target("x86-64-linux"));
  auto sum = context.create<Sum>();
  sum->set_generator_param_values({{"auto_schedule", "true"}});
  EXPECT_TRUE(sum->using_autoscheduler());
  sum->build_module("sum");
  EXPECT_GT(sum->get_pipeline().schedule_log().size(), 0u);
}

TEST(Generator, OptionsOfTheAutoschedulerAreAParam) {
  const GeneratorContext context(Target("x86-64-linux"));
  auto sum = context.create<Sum>();
  sum->set_generator_param_values(
      {{"auto_schedule", "true"}, {"autoschedule_options", "without=task_sizes,threads=1"}});
  sum->build_module("sum");
  EXPECT_EQ(names_in_nest(sum->get_pipeline().loop_nest(), "parallel"), std::vector<std::string>());
}

class Guarded : public Generator<Guarded> {
 public:
  Input<Buffer<float, 1>> in{"in"};
  Input<int> limit{"limit"};
  Output<Buffer<float, 1>> out{"out"};
  void generate() {
    add_requirement(limit > 3, "limit must exceed 3, it is ", limit);
    out(x) = in(x);
  }

 private:
  Var x{"x"};
};

TEST(Generator, RequirementsAreCheckedInEveryCall) {
  const GeneratorContext context(get_jit_target_from_environment());
  auto good = context.apply<Guarded>(ramp(4), 5);
  EXPECT_NO_THROW(good->realize({4}));
  auto bad = context.apply<Guarded>(ramp(4), 2);
  expect_error<RuntimeError>({"limit must exceed 3, it is 2"}, [&] { bad->realize({4}); });
}

}  // namespace

RETROGRADE_REGISTER_GENERATOR(BoxBlur, test_box_blur)
RETROGRADE_REGISTER_GENERATOR_ALIAS(test_wide_blur, test_box_blur, {{"radius", "4"}})

TEST(GeneratorRegistry, MakesGeneratorsByName) {
  const GeneratorContext context(get_jit_target_from_environment());
  auto blur = internal::GeneratorRegistry::create("test_box_blur", context);
  EXPECT_EQ(blur->name(), "test_box_blur");
  auto wide = internal::GeneratorRegistry::create("test_wide_blur", context);
  EXPECT_EQ(dynamic_cast<BoxBlur&>(*wide).radius, 4);
}

// Small parts of the public headers: accessors, aliases and switches that no other test needs.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cmath>

#include "frontend/schedule/autoscheduler.h"
#include "generator/registry.h"
#include "graph/graph.h"
#include "support/errors.h"

using namespace retrograde;
using internal::create_alias, internal::GeneratorRegistry;

namespace {

// ---- Buffer ----

TEST(BufferNames, TypesKnownToTheCompiler) {
  using Plane = Buffer<float, 2>;
  static_assert(Plane::has_static_halide_type && Plane::has_static_dimensions);
  static_assert(!Buffer<>::has_static_halide_type && !Buffer<>::has_static_dimensions);
  static_assert(Buffer<>::AnyDims < 0 && Plane::static_dimensions() == 2);
  static_assert(std::is_same_v<Plane::ElemType, float>);
  EXPECT_EQ(from_halide_type(Plane::static_halide_type()), Float(32));
  EXPECT_EQ(to_halide_type(UInt(16)), halide_type_of<uint16_t>());
  for (const Type type : {Int(8), UInt(1), Float(32, 4), BFloat(16), Handle()}) {
    EXPECT_EQ(type_word(type), to_halide_type(type).as_u32()) << type;
  }
  const Buffer<> any = Buffer<float>(3, 4);
  EXPECT_TRUE((Buffer<float>::can_convert_from(any)));
  EXPECT_FALSE((Buffer<int>::can_convert_from(any)));
  const Buffer<float>::RuntimeBuffer* runtime = Buffer<float>(any).get();
  EXPECT_EQ(runtime->width(), 3);
}

TEST(BufferNames, LayoutsAndCopies) {
  Buffer<int> b(4, 3, 2);
  b.for_each_element([&](int x, int y, int c) { b(x, y, c) = x + 10 * y + 100 * c; });
  b.set_name("picture");
  EXPECT_EQ(b.name(), "picture");
  const Buffer<int> interleaved = b.copy_to_interleaved(), planar = interleaved.copy_to_planar();
  EXPECT_EQ(interleaved.dim(2).stride(), 1);
  EXPECT_EQ(planar.dim(0).stride(), 1);
  EXPECT_EQ(interleaved(3, 2, 1), 123);
  EXPECT_EQ(planar(3, 2, 1), 123);
  EXPECT_EQ(Buffer<int>::make_with_shape_of(interleaved).dim(2).stride(), 1);
  Buffer<int> same = b.alias();
  same(0, 0, 0) = 7;
  EXPECT_EQ(b(0, 0, 0), 7);
  Buffer<int> part(2, 2, 2);
  part.translate({1, 1, 0});
  part.copy_from(b);
  EXPECT_EQ(part(2, 2, 1), 122);
}

TEST(BufferNames, DimensionsThatComeAndGo) {
  Buffer<int> b(4, 3);
  b.fill(1);
  b.transpose(0, 1);
  EXPECT_EQ(b.width(), 3);
  b.embed(2, 5);
  EXPECT_EQ(b.min(2), 5);
  b.add_dimension();
  EXPECT_EQ(b.dimensions(), 4);
  EXPECT_EQ(b.translated(0, 8).min(0), 8);
  b.deallocate();
  EXPECT_EQ(b.data(), nullptr);
}

TEST(BufferNames, MemoryIsTheHosts) {
  Buffer<int> b(4);
  EXPECT_FALSE(b.has_device_allocation());
  EXPECT_FALSE(b.device_dirty());
  b.set_host_dirty();
  EXPECT_TRUE(b.host_dirty());
  b.set_host_dirty(false);
  b.set_device_dirty(false);
  EXPECT_EQ(b.copy_to_host(), 0);
  EXPECT_EQ(b.device_sync(), 0);
  EXPECT_EQ(b.device_free(), 0);
  b.device_deallocate();
  EXPECT_EQ(b.device_detach_native(), 0);
}

// ---- Funcs, variables, references ----

struct FuncNames : testing::Test {
  Var x{"x"}, y{"y"};
  Func f{"f"};
  FuncNames() { f(x, y) = x + y; }
};

TEST_F(FuncNames, LoopsAndTheirPartition) {
  Func g("g");
  g(x, y) = f(x, y);
  g.parallel(y).serial(y).always_partition({x}).never_partition_all();
  Stage stage = g(x, y) += 1;
  EXPECT_EQ(stage.index(), 1);
  stage.serial(x).always_partition({y}).never_partition_all();
  stage.unscheduled();
  g.unscheduled();
  const Buffer<int> out = g.realize({4, 4});
  EXPECT_EQ(out(3, 2), 6);
  static_assert(std::is_same_v<ScheduleHandle, Stage>);
}

TEST_F(FuncNames, ElementsOfTuples) {
  Func pair("pair");
  pair(x) = Tuple(x, 2 * x);
  EXPECT_EQ(pair(x)[1].index(), 1);
  EXPECT_EQ(Tuple(pair(x)).as_vector().size(), 2u);
  EXPECT_EQ(pair.output_buffers().size(), 2u);
  Realization both = pair.realize({4});
  EXPECT_EQ(both.device_sync(), 0);
}

TEST_F(FuncNames, VariablesOfEveryKind) {
  EXPECT_TRUE(Var("_3").is_implicit());
  EXPECT_EQ(Var("_3").implicit_index(), 3);
  EXPECT_TRUE(_.to_var().is_placeholder());
  const std::vector<Var> all{_2, _3, _4, _5, _6, _7, _8, _9};
  for (size_t i = 0; i < all.size(); i++)
    EXPECT_EQ(all[i].implicit_index(), static_cast<int>(i) + 2);
  const VarOrRVar loop = x;
  EXPECT_EQ(loop.name(), "x");
  EXPECT_FALSE(loop.is_rvar);
}

TEST_F(FuncNames, ArgumentsOfExternFuncs) {
  ImageParam in(Int(32), 1, "in");
  const Buffer<int> image(4);
  EXPECT_TRUE(ExternFuncArgument(f).is_func());
  EXPECT_TRUE(ExternFuncArgument(Expr(3)).is_expr());
  EXPECT_TRUE(ExternFuncArgument(in).is_image_param());
  EXPECT_TRUE(ExternFuncArgument(image).is_buffer());
  EXPECT_FALSE(ExternFuncArgument().defined());
}

TEST_F(FuncNames, EstimatesOfImages) {
  ImageParam in(Int(32), 2, "in");
  in.dim(0).set_bounds_estimate(0, 640);
  EXPECT_TRUE(ir::is_const_int(in.dim(0).min_estimate(), 0));
  EXPECT_TRUE(ir::is_const_int(in.dim(0).extent_estimate(), 640));
}

TEST_F(FuncNames, ParamsTellTheirTypeAndLimits) {
  Param<float> p("p");
  static_assert(Param<float>::has_static_type && !Param<>::has_static_type);
  EXPECT_EQ(Param<float>::static_type(), Float(32));
  p.set_min_value(0.5f);
  EXPECT_EQ(*ir::as_const_float(p.min_value()), 0.5);
  p.promise_finite();
  Func f("f");
  f() = p;
  EXPECT_NE(graph::to_text(graph::graph_of({f.function()})).find("\n  finite\n"),
            std::string::npos);
  EXPECT_EQ(ParamMap::empty_map().size(), 0u);
  EXPECT_EQ(ParamMap::empty_map().find(p.parameter()), nullptr);
  const ParamMap::ParamMapping mapping(p, 2.0f);
  EXPECT_EQ(ParamMap({mapping}).size(), 1u);
}

// ---- pipelines ----

int twice(int v) { return 2 * v; }

TEST_F(FuncNames, WhatPipelinesCall) {
  const JITExtern function(twice);
  const ExternSignature& types = function.extern_c_function().signature();
  EXPECT_EQ(types.ret_type(), Int(32));
  EXPECT_FALSE(types.is_void_return());
  EXPECT_EQ(types.arg_types(), std::vector<Type>{Int(32)});
  EXPECT_EQ(function.extern_c_function().address(), reinterpret_cast<void*>(twice));
  EXPECT_FALSE(function.pipeline().defined());
  f.set_jit_externs({{"twice", function}});
  EXPECT_EQ(f.get_jit_externs().size(), 1u);
  Pipeline p(f);
  p.set_jit_externs({{"twice", function}});
  EXPECT_EQ(p.get_jit_externs().count("twice"), 1u);
}

TEST_F(FuncNames, PipelinesAreShownAndForgotten) {
  Pipeline p(f);
  testing::internal::CaptureStderr();
  p.print_loop_nest();
  expect_mentions(testing::internal::GetCapturedStderr(), {"f"});
  Buffer<int> out(2, 2);
  const Pipeline::RealizationArg argument(out);
  EXPECT_EQ(argument.buffers().size(), 1u);
  p.realize(out);
  p.invalidate_cache();
  p.realize(out);
  EXPECT_EQ(out(1, 1), 2);
  EXPECT_THROW(p.compile_to_c("f.c", {}, "f"), Unsupported);
  EXPECT_EQ(evaluate_may_gpu<int>(Expr(3) + 4), 7);
}

TEST_F(FuncNames, HandlersThatNothingCalls) {
  JITHandlers& handlers = f.jit_handlers();
  EXPECT_EQ(handlers.custom_get_symbol, nullptr);
  EXPECT_EQ(handlers.custom_load_library, nullptr);
  EXPECT_EQ(handlers.custom_get_library_symbol, nullptr);
}

TEST_F(FuncNames, ModulesAndTheirFiles) {
  const Module m = Pipeline(f).compile_to_module({}, "f");
  EXPECT_FALSE(m.target().has_unknowns());
  EXPECT_FALSE(m.any_strict_float());
  EXPECT_TRUE(m.submodules().empty());
  const auto files = internal::get_output_info(m.target());
  const internal::OutputInfo& object = files.at(OutputFileType::object);
  EXPECT_EQ(object.name, "object");
  EXPECT_EQ(object.extension, ".o");
  EXPECT_TRUE(object.is_multi);
  const ModuleFactory again = [&](const std::string&, const Target&) { return m; };
  EXPECT_EQ(again("f", m.target()).name(), m.name());
  EXPECT_NE(StmtOutputFormat::Text, StmtOutputFormat::HTML);
}

// ---- automatic schedules ----

TEST_F(FuncNames, AnAutoschedulerOfTheProgram) {
  const AutoSchedulerFn scheduler = [](const Pipeline&, const Target& target,
                                       const MachineParams& machine,
                                       AutoSchedulerResults* results) {
    results->scheduler_name = "mine";
    results->target = target;
    results->machine_params_string = machine.to_string();
    results->featurization = {1};
  };
  add_autoscheduler("mine", scheduler);
  EXPECT_EQ(autoscheduler_names(), (std::vector<std::string>{built_in_autoscheduler, "mine"}));
  EXPECT_EQ(default_autoscheduler_name(), built_in_autoscheduler);
  Pipeline::set_default_autoscheduler_name("mine");
  EXPECT_EQ(default_autoscheduler_name(), "mine");
  MachineParams machine = MachineParams::generic();
  machine.last_level_cache_size = 1 << 20;
  machine.balance = 8;
  const AutoSchedulerResults results =
      Pipeline(f).auto_schedule("mine", get_host_target(), machine);
  EXPECT_EQ(results.scheduler_name, "mine");
  EXPECT_EQ(results.machine_params_string, "16,1048576,8");
  EXPECT_EQ(results.featurization.size(), 1u);
  set_default_autoscheduler_name("");
  add_autoscheduler("mine", nullptr);
}

// ---- targets and types ----

TEST(TargetNames, FeaturesTogether) {
  Target t(Target::Linux, Target::X86, 64);
  t.set_features({Target::AVX2, Target::FMA});
  EXPECT_TRUE(t.features_all_of({Target::AVX2, Target::FMA}));
  EXPECT_TRUE(t.features_any_of({Target::CUDA, Target::FMA}));
  EXPECT_FALSE(t.features_any_of({Target::CUDA}));
  EXPECT_EQ(t.get_features_bitset().count(), 2u);
  EXPECT_FALSE(t.has_large_buffers());
  EXPECT_EQ(t.maximum_buffer_size(), INT32_MAX);
  EXPECT_TRUE(t.supports_type(Float(32)));
  EXPECT_TRUE(t.supports_device_api(DeviceAPI::Host));
  EXPECT_FALSE(t.supports_device_api(DeviceAPI::CUDA));
  EXPECT_EQ(target_feature_for_device_api(DeviceAPI::CUDA), Target::CUDA);
  EXPECT_TRUE(host_supports_target_device(t));
  const Target::OS os = t.os;
  const Target::Arch arch = t.arch;
  EXPECT_EQ(os, Target::Linux);
  EXPECT_EQ(arch, Target::X86);
}

TEST(TypeNames, KindsAndForms) {
  EXPECT_TRUE(Int(8).is_int_or_uint());
  EXPECT_TRUE(Handle().is_handle());
  EXPECT_TRUE(Float(32, 4).is_vector());
  EXPECT_EQ(Int(16).with_code(TypeCode::UInt), UInt(16));
  EXPECT_EQ(Float(32, 4).element_of(), Float(32));
  EXPECT_TRUE(Int(16).can_represent(UInt(8)));
  EXPECT_FALSE(UInt(8).can_represent(int64_t{-1}));
  EXPECT_TRUE(Handle().same_handle_type(Handle()));
}

// api: operator<=>
TEST(TypeNames, SmallFloats) {
  EXPECT_LT(float16_t(1.0), float16_t(2.0));
  EXPECT_TRUE(std::isinf(static_cast<double>(float16_t::make_negative_infinity())));
  EXPECT_TRUE(std::isnan(static_cast<double>(float16_t::make_nan())));
  EXPECT_TRUE(std::isinf(static_cast<double>(bfloat16_t::make_negative_infinity())));
  EXPECT_TRUE(std::isnan(static_cast<double>(bfloat16_t::make_nan())));
  EXPECT_TRUE(bfloat16_t(0.0).is_zero());
  static_assert(SmallFloatType<float16_t> && !SmallFloatType<float>);
  static_assert(IntegerConstant<short> && !IntegerConstant<bool>);
}

TEST(TypeNames, ExprsInOrder) {
  const Expr a = 1, b = 2;
  const ExprCompare less;
  EXPECT_NE(less(a, b), less(b, a));
  EXPECT_FALSE(less(a, a));
}

// ---- derivatives ----

TEST(DerivativeNames, TangentsAndDirections) {
  Buffer<float> in(8);
  in.fill(2.0f);
  Var x("x");
  Func f("f"), direction("direction");
  f(x) = in(x)*in(x);
  direction(x) = 1.0f;
  EXPECT_EQ(Direction::as_func(Buffer<float>(8)).dimensions(), 1);
  const Tangents tangents = propagate_tangents(f, {{in, direction}});
  EXPECT_FALSE(tangents.funcs().empty());
  EXPECT_FALSE(tangents.explanations().empty());
  JacobianOptions options;
  EXPECT_GT(jacobian(f, in, {{0, 8}}, options).colours(), 0);
}

struct LossNames : testing::Test {
  Buffer<float> in{8};
  Var x{"x"};
  RDom r{0, 8};
  Func loss{"loss"};
  LossNames() {
    in.fill(2.0f);
    loss() = 0.0f;
    loss() += in(r)*in(r)*in(r);
  }
};

TEST_F(LossNames, ReportsOfGradients) {
  const GradientReport report = check_gradients(loss, {}, {.directions = 1, .seed = 7});
  ASSERT_EQ(report.inputs.size(), 1u);
  const GradientReport::Input& input = report.inputs[0];
  EXPECT_LT(input.adjoint_error, 1e-6);
  EXPECT_LT(input.complex_step_error, 1e-9);
  EXPECT_LT(input.dot_product_error, 1e-9);
  EXPECT_LT(input.own_precision_error, 1e-5);
  ASSERT_FALSE(input.steps.empty());
  EXPECT_GE(input.steps[0].richardson_error, 0);
  EXPECT_GE(report.primal_seconds, 0);
  EXPECT_GE(report.adjoint_seconds, 0);
}

TEST_F(LossNames, OptionsOfStability) {
  StabilityOptions options;
  options.extremes = {Extreme::Huge};
  options.samples = 1;
  options.perturbations = 1;
  options.seed = 3;
  expect_mentions(check_stability(loss, {}, options).to_json(), {"uge"});
}

TEST_F(LossNames, CompressedProducts) {
  Func f("f");
  f(x) = in(x)*in(x);
  EXPECT_TRUE(jacobian(f, in, {{0, 8}}).compressed().defined());
  EXPECT_TRUE(hessian_diagonal(loss, in).compressed.defined());
}

TEST_F(LossNames, RulesOfOnesOwn) {
  EXPECT_TRUE(AdjointContribution::zero(in).is_zero);
  Func f("f"), direction("direction");
  f(x) = in(x);
  direction(x) = 1.0f;
  const TangentContext::Moving nothing;
  EXPECT_FALSE(TangentContext(f, {in}, nothing).moves(in));
  const CustomTangent rule = [&](const TangentContext& c) { return c.tangent(in); };
  custom_tangent(f, {in}, rule);
  const Buffer<float> tangent = propagate_tangents(f, {{in, direction}})(f).realize({8});
  EXPECT_EQ(tangent(3), 1.0f);
}

// ---- handlers ----

int calls_of_tasks, calls_of_loops, calls_of_print;

TEST(HandlerNames, OfAPipelineAndOfAFunc) {
  Var x("x");
  Func f("f");
  f(x) = print(x);
  f.parallel(x);
  const auto task = [](void*, int (*body)(void*, int, uint8_t*), int at, uint8_t* closure) {
    calls_of_tasks++;
    return body(nullptr, at, closure);
  };
  const auto loop = [](void*, int (*body)(void*, int, uint8_t*), int min, int extent,
                       uint8_t* closure) {
    calls_of_loops++;
    for (int i = min; i < min + extent; i++) {
      if (const int code = body(nullptr, i, closure)) return code;
    }
    return 0;
  };
  const auto count_print = [](void*, const char*) { calls_of_print++; };
  const auto ignore_error = [](void*, const char*) {};
  Pipeline p(f);
  p.set_custom_do_par_for(loop);
  p.set_custom_do_task(task);
  p.set_custom_print(count_print);
  p.set_error_handler(ignore_error);
  p.realize({4});
  f.set_custom_do_par_for(loop);
  f.set_custom_do_task(task);
  f.set_custom_print(count_print);
  f.set_error_handler(ignore_error);
  f.realize({4});
  EXPECT_EQ(calls_of_loops, 2);
  EXPECT_EQ(calls_of_print, 8);
}

// ---- generators ----

// api: GeneratorParam::operator T
class NamesGenerator : public Generator<NamesGenerator> {
 public:
  GeneratorParam<int> count{"count", 2};
  Input<Buffer<float>> in{"in", 2};
  Input<float> gain{"gain"};
  Input<Func[]> open{"open"};
  Output<Buffer<float>> out{"out", 2};
  Output<Buffer<uint8_t>> colours{"colours", 3};
  void configure() {
    EXPECT_FALSE(open.array_size_defined());
    open.set_array_size(count);
    open.set_types({Float(32)});
    open.set_dimensions(2);
  }
  void generate() {
    Var x("x"), y("y");
    out(x, y) = in(x, y) * gain * natural_vector_size<float>();
    for (int i = 0; i < count; i++) out(x, y) += open[i](x, y);
    colours(x, y, Var("c")) = cast<uint8_t>(x);
  }
  void schedule() {
    trace_pipeline();
    const OutputImageParam written = out;
    EXPECT_TRUE(written.defined());
    EXPECT_EQ(in.dimensions(), 2);
    EXPECT_EQ(out.dimensions(), 2);
    EXPECT_TRUE(in.types_defined());
    EXPECT_TRUE(in.dims_defined());
    EXPECT_FALSE(in.is_array());
    EXPECT_EQ(get_target(), context().get_target());
    EXPECT_FALSE(get_auto_schedule());
    EXPECT_FALSE(context().get_auto_schedule());
    EXPECT_EQ(get_machine_params().parallelism, context().get_machine_params().parallelism);
    EXPECT_TRUE(colours.channels().defined());
    in.set_estimates({{0, 64}, {0, 48}});
    gain.set_estimate(1.5f);
    out.set_estimates({{0, 64}, {0, 48}});
    for (const Expr& e : {out.left(), out.right(), out.top(), out.bottom(), out.height()})
      EXPECT_TRUE(e.defined());
  }
};

TEST(GeneratorNames, AGeneratorLooksAtItself) {
  GeneratorRegistry::register_factory(
      "names", [](const GeneratorContext& context) { return NamesGenerator::create(context); });
  const std::vector<std::string> all = GeneratorRegistry::enumerate();
  EXPECT_NE(std::find(all.begin(), all.end(), "names"), all.end());
  const auto generator = GeneratorRegistry::create("names", GeneratorContext(get_host_target()));
  EXPECT_FALSE(generator->build_module("names").functions().empty());
  EXPECT_NE(
      create_alias("more_names", "names", {{"count", "3"}}, GeneratorContext(get_host_target())),
      nullptr);
  GeneratorRegistry::unregister_factory("names");
  EXPECT_THROW(GeneratorRegistry::create("names", GeneratorContext(get_host_target())), UserError);
}

}  // namespace

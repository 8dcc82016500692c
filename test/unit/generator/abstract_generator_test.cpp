// Tests user-defined subclasses of AbstractGenerator, the AbstractGenerator interface of
// Generator<>, and running generators from C++.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "Halide.h"
#include "support/errors.h"
#include "support/temporary_folder.h"

using namespace Halide;
using Halide::Internal::AbstractGenerator, Halide::Internal::AbstractGeneratorPtr;
using Halide::Internal::ArgInfoDirection, Halide::Internal::ArgInfoKind;
using Halide::Internal::execute_generator, Halide::Internal::ExecuteGeneratorArgs;
using Halide::Internal::GeneratorRegistry;
using retrograde::error_of, retrograde::expect_error, retrograde::expect_mentions;

namespace {

using Names = std::vector<std::string>;

// out(x) = scale * (in_0(x) + ... + in_n(x)) + offset, with its inputs as plain parameters.
class Weighted : public AbstractGenerator {
 public:
  explicit Weighted(const GeneratorContext& context) : context_(context) {
    for (int i = 0; i < 2; i++) images_.emplace_back(Float(32), 1, "in_" + std::to_string(i));
  }
  std::string name() override { return "weighted"; }
  GeneratorContext context() const override { return context_; }
  std::vector<ArgInfo> arginfos() override {
    return {{"in", ArgInfoDirection::Input, ArgInfoKind::Buffer, {Float(32)}, 1},
            {"offset", ArgInfoDirection::Input, ArgInfoKind::Scalar, {Float(32)}, 0},
            {"out", ArgInfoDirection::Output, ArgInfoKind::Buffer, {Float(32), Int(32)}, 1},
            {"plain", ArgInfoDirection::Output, ArgInfoKind::Function, {declared_type}, 1}};
  }
  bool allow_out_of_order_inputs_and_outputs() const override { return false; }
  void set_generatorparam_value(const std::string& name, const std::string& value) override {
    _halide_user_assert(name == "scale") << "there is only scale";
    scale_ = std::stof(value);
  }
  void set_generatorparam_value(const std::string& name, const LoopLevel&) override {
    _halide_user_assert(false) << name << " is no level";
  }
  Pipeline build_pipeline() override {
    Var x("x");
    Expr sum = offset_value_.defined() ? offset_value_ : Expr(offset_);
    if (func_.defined()) sum += func_(x);
    for (size_t i = 0; !func_.defined() && i < images_.size(); i++) sum += images_[i](x) * scale_;
    out_(x) = Tuple(sum, x);
    plain_(x) = sum;
    return Pipeline({out_, plain_});
  }
  std::vector<Parameter> input_parameter(const std::string& name) override {
    if (name == "offset") return {offset_.parameter()};
    return {images_[0].parameter(), images_[1].parameter()};
  }
  std::vector<Func> output_func(const std::string& name) override {
    return {name == "out" ? out_ : plain_};
  }
  void bind_input(const std::string&, const std::vector<Parameter>& values) override {
    images_.clear();
    for (const Parameter& parameter : values) images_.emplace_back(parameter);
  }
  void bind_input(const std::string&, const std::vector<Func>& values) override {
    func_ = values.at(0);
  }
  void bind_input(const std::string&, const std::vector<Expr>& values) override {
    offset_value_ = values.at(0);
  }
  bool emit_cpp_stub(const std::string&) override { return false; }
  bool emit_hlpipe(const std::string&) override { return false; }

  Type declared_type = Float(32);

 private:
  const GeneratorContext context_;
  float scale_ = 1;
  std::vector<ImageParam> images_;
  Param<float> offset_{"offset"};
  Expr offset_value_;
  Func func_, out_{"out"}, plain_{"plain"};
};

const Internal::RegisterGenerator registered("weighted", [](const GeneratorContext& context) {
  return AbstractGeneratorPtr(new Weighted(context));
});

GeneratorContext host() { return GeneratorContext(get_jit_target_from_environment()); }

Names argument_names(const Module& module) {
  Names names;
  const auto shown = module.get_metadata_name_map();
  for (const auto& argument : module.functions().back().args) {
    const auto found = shown.find(argument.name);
    names.push_back(found == shown.end() ? argument.name : found->second);
  }
  return names;
}

TEST(AbstractGenerators, AreCompiledLikeAnyOther) {
  Buffer<float, 1> a(4), b(4), out(4), plain(4);
  Buffer<int, 1> index(4);
  a.for_each_element([&](int i) { a(i) = i; });
  b.fill(10);
  Callable weighted = create_callable_from_generator(host(), "weighted", {{"scale", "3"}});
  ASSERT_EQ(weighted(a, b, 0.5f, out, index, plain), 0);
  for (int i = 0; i < 4; i++) {
    EXPECT_EQ(out(i), 3 * (i + 10) + 0.5f);
    EXPECT_EQ(plain(i), out(i));
    EXPECT_EQ(index(i), i);
  }
  EXPECT_EQ(argument_names(GeneratorRegistry::create("weighted", host())->build_module("w")),
            (Names{"in_0", "in_1", "offset", "out.0", "out.1", "plain"}));
}

// api: as_generator_base
TEST(AbstractGenerators, GiveModulesThemselves) {
  Weighted weighted(host());
  weighted.set_generatorparam_values({{"scale", "2"}});
  EXPECT_EQ(argument_names(weighted.build_module("w")).size(), 6u);
  EXPECT_EQ(Weighted(host()).build_module().functions().back().name, "weighted");
  Buffer<float, 1> a(2), out(2), plain(2);
  Buffer<int, 1> index(2);
  a.fill(1);
  Weighted called(host());
  ASSERT_EQ(called.compile_to_callable()(a, a, 0.25f, out, index, plain), 0);
  EXPECT_EQ(plain(1), 2.25f);
  expect_error({"gradients are of outputs with one value"},
               [&] { Weighted(host()).build_gradient_module("g"); });
}

TEST(AbstractGenerators, TakeValuesForTheirInputs) {
  auto weighted = GeneratorRegistry::create("weighted", host());
  const ImageParam a(Float(32), 1, "a"), b(Float(32), 1, "b"), c(Float(32), 1, "c");
  weighted->bind_input(
      "in", {Parameter(a.parameter()), Parameter(b.parameter()), Parameter(c.parameter())});
  weighted->bind_input("offset", std::vector<Expr>{Expr(7.0f)});
  Pipeline pipeline = weighted->build_pipeline();
  Buffer<float, 1> ones(3);
  ones.fill(1);
  for (ImageParam image : {a, b, c}) image.set(ones);
  Realization values = pipeline.realize({3});
  Buffer<float, 1> plain = values[2];
  EXPECT_EQ(plain(2), 10.0f);
}

TEST(AbstractGenerators, KeepWhatTheySay) {
  try {
    create_callable_from_generator(host(), "weighted", {{"colour", "red"}});
    ADD_FAILURE() << "its own check was passed";
  } catch (const CompileError& error) {
    expect_mentions(error.what(), {"there is only scale"});
  }
  const ExecuteGeneratorArgs::CreateGeneratorFn other_type = [](const std::string&,
                                                                const GeneratorContext& context) {
    auto weighted = std::make_unique<Weighted>(context);
    weighted->declared_type = UInt(8);
    return AbstractGeneratorPtr(std::move(weighted));
  };
  expect_error({"its type is declared once", "uint8"},
               [&] { other_type("", host())->build_module("w"); });
  expect_error({"a generator is defined"}, [] { Internal::as_generator_base(nullptr); });
}

// ---- Generator<> through the AbstractGenerator interface ----

class Plain : public Halide::Generator<Plain> {
 public:
  GeneratorParam<int> factor{"factor", 2};
  GeneratorParam<LoopLevel> level{"level", LoopLevel::root()};
  Input<Buffer<int, 1>> in{"in"};
  Input<Func> f{"f", Int(32), 1};
  Input<int> offset{"offset"};
  Output<Buffer<>> out{"out", 1};
  void generate() {
    Var x("x");
    out(x) = in(x) * static_cast<int>(factor) + f(x) + offset;
  }
};

AbstractGeneratorPtr plain() { return Plain::create(host()); }

TEST(AbstractGenerators, AreAllGenerators) {
  AbstractGeneratorPtr generator = plain();
  generator->set_generatorparam_value("factor", "3");
  generator->set_generatorparam_value("level", LoopLevel::inlined());
  const std::vector<AbstractGenerator::ArgInfo> infos = generator->arginfos();
  ASSERT_EQ(infos.size(), 4u);
  EXPECT_EQ(infos[1].name, "f");
  EXPECT_EQ(infos[1].kind, ArgInfoKind::Function);
  EXPECT_EQ(infos[1].types, std::vector<Type>{Int(32)});
  EXPECT_EQ(infos[1].dimensions, 1);
  EXPECT_EQ(infos[3].dir, ArgInfoDirection::Output);
  EXPECT_TRUE(infos[3].types.empty());
  EXPECT_FALSE(generator->allow_out_of_order_inputs_and_outputs());
  EXPECT_FALSE(generator->emit_hlpipe("none"));
  EXPECT_EQ(generator->name(), "generator") << "until it is registered";
  EXPECT_EQ(generator->context().get_target(), host().get_target());

  Func squares("squares");
  Var x("x");
  squares(x) = x * x;
  generator->bind_input("f", std::vector<Func>{squares});
  Pipeline pipeline = generator->build_pipeline();
  EXPECT_EQ(generator->output_func("out").at(0).dimensions(), 1);
  Buffer<int, 1> in(3);
  in.fill(5);
  ImageParam(generator->input_parameter("in").at(0)).set(in);
  generator->input_parameter("offset").at(0).set_scalar(100);
  Buffer<int, 1> out = pipeline.realize({3});
  EXPECT_EQ(out(2), 5 * 3 + 4 + 100);
  expect_error({"its inputs are those of the compiled function", "\"f\""},
               [&] { generator->input_parameter("f"); });
  expect_error({"an input has the name that the generator declares", "\"in\", \"f\", \"offset\""},
               [&] { generator->input_parameter("nobody"); });
  expect_error({"only what the generator declares can be set"},
               [&] { plain()->set_generatorparam_value("colour", "red"); });
}

// ---- from C++ to files ----

class ExecuteGenerator : public testing::Test {
 protected:
  ExecuteGenerator() {
    args.output_dir = folder.path();
    args.output_types = {OutputFileType::c_header, OutputFileType::object};
    args.targets = {Target("host-no_runtime")};
    args.generator_name = "weighted";
  }
  Names files() const {
    Names names;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
      names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }
  std::string contents(const std::string& name) const {
    std::ifstream in(folder.path() / name);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  const TemporaryFolder folder;
  ExecuteGeneratorArgs args;
};

TEST_F(ExecuteGenerator, WritesItsFiles) {
  args.function_name = "ns::function";
  args.targets = {Target("host-no_runtime-c_plus_plus_name_mangling")};
  args.generator_params = {{"scale", "4"}};
  args.log_outputs = true;
  testing::internal::CaptureStdout();
  execute_generator(args);
  expect_mentions(testing::internal::GetCapturedStdout(), {"/function.h\n", "/function.o\n"});
  EXPECT_EQ(files(), (Names{"function.h", "function.o"}));
  expect_mentions(contents("function.h"), {"namespace ns {", "float _offset"});
}

TEST_F(ExecuteGenerator, TakesAFunctionThatMakesTheGenerator) {
  args.generator_name = "anything";
  args.file_base_name = "files";
  args.create_generator = [](const std::string& name, const GeneratorContext&) {
    EXPECT_EQ(name, "anything");
    return plain();
  };
  execute_generator(args);
  expect_mentions(contents("files.h"), {"int anything(struct halide_buffer_t *_in_buffer"});
  const ExecuteGeneratorArgs::BuildMode gradient = ExecuteGeneratorArgs::Gradient;
  args.build_mode = gradient;
  expect_error({"gradients are of floating-point outputs"}, [&] { execute_generator(args); });
}

TEST_F(ExecuteGenerator, ServesSeveralTargetsAndRuntimes) {
  args.output_types = {OutputFileType::c_header, OutputFileType::static_library,
                       OutputFileType::stmt};
  args.targets = {Target("x86-64-linux-avx2"), Target("x86-64-linux")};
  args.suffixes = {"fast", "plain"};
  execute_generator(args);
  EXPECT_EQ(files(),
            (Names{"weighted-fast.stmt", "weighted-plain.stmt", "weighted.a", "weighted.h"}));
  args.suffixes.clear();
  args.generator_name.clear();
  args.runtime_name = "the_runtime";
  args.output_types = {OutputFileType::static_library};
  execute_generator(args);
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "the_runtime.a"));
}

// Names an autoscheduler of Halide; the built-in one is used instead.
TEST_F(ExecuteGenerator, NamesAScheduler) {
  Names warnings;
  retrograde::WarningScope scope([&](const std::string& text) { warnings.push_back(text); });
  args.generator_params = {{"autoscheduler", "Mullapudi2016"}, {"autoscheduler.parallelism", "4"}};
  args.create_generator = [](const std::string&, const GeneratorContext& context) {
    EXPECT_EQ(context.autoscheduler_params().name, "Mullapudi2016");
    EXPECT_EQ(context.autoscheduler_params().extra.at("parallelism"), "4");
    return plain();
  };
  execute_generator(args);
  EXPECT_EQ(files().size(), 2u);
}

TEST_F(ExecuteGenerator, SaysWhatIsMissing) {
  const auto refused = [&](const char* rule, auto&& change) {
    ExecuteGeneratorArgs wrong = args;
    change(wrong);
    expect_error({rule}, [&] { execute_generator(wrong); });
  };
  refused("output_dir names the folder of the files", [](auto& a) { a.output_dir.clear(); });
  refused("output_types names what to write", [](auto& a) { a.output_types.clear(); });
  refused("targets name what to compile for", [](auto& a) { a.targets.clear(); });
  refused("there is one suffix for each target", [](auto& a) { a.suffixes = {"a", "b"}; });
  refused("generator_name names the generator, or runtime_name a runtime",
          [](auto& a) { a.generator_name.clear(); });
  refused("a generator is created by the name that it is registered under",
          [](auto& a) { a.generator_name = "nobody"; });
}

}  // namespace

// Rules of modules, targets, derivatives and generators that no other test covers.
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "error/rules.h"
#include "frontend/schedule/autoscheduler.h"
#include "generator/command_line.h"
#include "generator/registry.h"
#include "ir/parse.h"
#include "support/errors.h"
#include "support/temporary_folder.h"

namespace retrograde {
namespace {

using internal::GeneratorFactory, internal::GeneratorRegistry;

// ---- modules, targets, autoschedulers ----

TEST_F(Rules, ModulesHoldFunctions) {
  Module m("m", get_host_target());
  expect("a module has the functions that were appended to it",
         [&] { m.get_function_by_name("missing"); });
  expect("a module contains other modules", [&] { m.append(m); });
}

TEST_F(Rules, SeveralTargets) {
  const Target host = get_host_target();
  const auto make = [&](const std::string& name, const Target& target) {
    return Pipeline(f).compile_to_module({}, name, target);
  };
  expect("there is one suffix for each target", [&] {
    compile_multitarget("g", {}, {host, host}, {"_a"}, make);
  });
  expect("the function is called in the same way for all targets", [&] {
    compile_multitarget("g", {}, {host.with_feature(Target::UserContext), host}, {}, make);
  });
}

TEST_F(Rules, TargetsOfThisProcess) {
  setenv("HL_JIT_TARGET", "arm-32-android", 1);
  expect("the target of HL_JIT_TARGET is one that this machine can run",
         [&] { get_jit_target_from_environment(); });
  unsetenv("HL_JIT_TARGET");
  expect<Unsupported>("the JIT runs code on this machine", [&] {
    f.realize({4, 4}, Target("x86-32-linux"));
  });
}

TEST_F(Rules, Autoschedulers) {
  const AutoSchedulerFn nothing = [](const Pipeline&, const Target&, const MachineParams&,
                                     AutoSchedulerResults*) {};
  add_autoscheduler("twice", nothing);
  add_autoscheduler("twice", nothing);
  expect("autoschedulers have different names", [&] { find_autoscheduler("twice"); });
  add_autoscheduler("twice", nullptr);
  expect("an autoscheduler is loaded from a plugin before it is used",
         [&] { find_autoscheduler("nobody"); });
  expect("it is a shared library that can be opened", [&] { load_plugin("./no_such_plugin.so"); });
}

TEST_F(Rules, FoldersThatTakeNoKey) {
  const TemporaryFolder folder;
  std::filesystem::permissions(folder.path(), std::filesystem::perms::owner_all);
  std::filesystem::create_directories(folder.path() / "key" / "in_the_way");
  expect("its folder must be writable",
         [&] { set_compile_cache_directory(folder.path().string()); });
  set_compile_cache_directory("");
}

TEST_F(Rules, FoldersOfCompiledCode) {
  expect("its size in bytes is positive", [&] { set_compile_cache_directory("/tmp/unused", 0); });
}

TEST_F(Rules, TextOfPrograms) {
  expect("operands must fit each other", [&] { ir::parse_expr("x + 1.5f"); });
  expect(": expected ", [&] { ir::parse_expr("x +"); });
}

// ---- derivatives ----

TEST_F(Rules, AdjointsOfWhatIsThere) {
  Func g("g"), loss("loss");
  Buffer<float> in(8);
  in.fill(1.0f);
  g(x) = in(x);
  RDom r(0, 8);
  loss() = 0.0f;
  loss() += g(r) * g(r);
  const Derivative d = propagate_adjoints(loss);
  expect("a Func has an adjoint after each of its definitions", [&] { d(g, 3); });
  expect("a Func has a definition", [&] { d(Func("nobody")); });
  expect("the adjoint must be a defined Buffer", [&] { propagate_adjoints(g, Buffer<float>()); });
  Func pair("pair");
  pair() = Tuple(in(0), in(1));
  expect("a scalar output has one value", [&] { propagate_adjoints(pair); });
  const Jacobian j = jacobian(g, in, {{0, 8}});
  expect("an element has a coordinate in each dimension", [&] { j.colour({Expr(1), Expr(2)}); });
}

TEST_F(Rules, ShapesOfAdjoints) {
  Func g("g"), flat("flat"), pair("pair");
  g(x) = cast<float>(x);
  flat(x, y) = 1.0f;
  pair(x) = Tuple(1.0f, 1.0f);
  expect("the output needs bounds in each of its dimensions",
         [&] { propagate_adjoints(g, pair, Region{}); });
  expect("an adjoint has the dimensions of its Func", [&] {
    propagate_adjoints(g, flat, {{0, 8}});
  });
  expect("an adjoint has as many values as its Func", [&] {
    propagate_adjoints(g, pair, {{0, 8}});
  });
}

TEST_F(Rules, SeedsThroughCFunctions) {
  Func in("in"), outside("outside"), g("g");
  Buffer<float> image(8);
  image.fill(1.0f);
  in(x) = image(x);
  outside.define_extern("somewhere", {in}, Float(32), 1);
  g(x) = outside(x) + in(x)*in(x);
  custom_tangent(outside, {in}, [&](const TangentContext& c) {
    Func tangent("tangent");
    tangent.define_extern("its_tangent", {c.tangent(in)}, Float(32), 1);
    return tangent;
  });
  custom_adjoint(outside, {in}, [&](const AdjointContext& c) {
    Func adjoint("adjoint");
    adjoint.define_extern("its_adjoint", {c.adjoint()}, Float(32), 1);
    return std::vector<AdjointContribution>{{in, adjoint}};
  });
  for (const Compression way : {Compression::Rows, Compression::Columns}) {
    expect<Unsupported>("which element depends on which is read off definitions", [&] {
      jacobian(g, image, {{0, 8}}, {.compression = way});
    });
  }
}

TEST_F(Rules, BudgetsOfCheckpoints) {
  Buffer<float> start(8);
  start.fill(0.5f);
  Func u("u"), loss("loss");
  RDom t(0, 10), r(0, 8);
  u(x) = start(x);
  u(x) = sin(u(x)) + cast<float>(t) * 0.0f;
  loss() = 0.0f;
  loss() += u(r) * u(r);
  expect("the budget must have room for one state, the first",
         [&] { propagate_adjoints(loss, {.checkpoint_bytes = 4}); });
}

TEST_F(Rules, VersionsOfElementsWithoutBounds) {
  Buffer<float> in(8);
  ImageParam at(Int(32), 1, "at");
  in.fill(1.0f);
  Func u("u"), loss("loss");
  RDom r(0, 8);
  u(x) = in(0) + cast<float>(x);
  u(at(r)) = u(at(r)) * u(at(r));
  loss() = 0.0f;
  loss() += u(at(r));
  expect<Unsupported>("an update that runs backward needs to know the elements it may reach",
                      [&] { propagate_adjoints(loss, {.overwritten = Overwritten::Store}); });
}

TEST_F(Rules, TangentsThroughCFunctions) {
  Func outside("outside"), in("in"), moves("moves");
  in(x) = cast<float>(x);
  moves(x) = 1.0f;
  outside.define_extern("somewhere", {in}, Float(32), 1);
  Func g("g");
  g(x) = outside(x);
  expect<Unsupported>("derivatives come from definitions", [&] {
    propagate_tangents(g, {{in, moves}});
  });
}

TEST_F(Rules, ChecksOfBoundInputs) {
  ImageParam in(Float(32), 1, "in");
  RDom r(0, 4);
  Func loss("loss");
  loss() = 0.0f;
  loss() += in(r)*in(r);
  expect<RuntimeError>("every input must be bound", [&] { check_gradients(loss); });
}

TEST_F(Rules, ChecksInDouble) {
  Func outside("outside"), loss("loss");
  Buffer<float> in(4);
  in.fill(1.0f);
  outside.define_extern("somewhere", {}, Float(32), 1);
  RDom r(0, 4);
  loss() = 0.0f;
  loss() += in(r)*outside(r);
  expect<Unsupported>("every operation needs a meaning in double", [&] { check_gradients(loss); });
}

// ---- generators ----

class ByteGenerator : public Generator<ByteGenerator> {
 public:
  Input<uint8_t> gain{"gain"};
  Output<Func> out{"out", UInt(8), 1};
  void generate() { out(Var("x")) = cast<uint8_t>(Var("x")) * gain; }
};

class RuleGenerator : public Generator<RuleGenerator> {
 public:
  GeneratorParam<int> count{"count", 1};
  Input<Buffer<float, 1>> in{"in"};
  Output<Func> out{"out"};
  Output<Buffer<>> sums{"sums"};
  void generate() {
    Var x("x");
    out(x) = in(x) * static_cast<float>(static_cast<int>(count));
    sums(x) = Tuple(in(x), in(x));
  }
};
RETROGRADE_REGISTER_GENERATOR(RuleGenerator, rule_generator)

TEST_F(Rules, PartsOfAGenerator) {
  const auto create = [] {
    return GeneratorRegistry::create("rule_generator", GeneratorContext(get_host_target()));
  };
  expect("a generator is created by the name that it is registered under",
         [] { GeneratorRegistry::create("nobody", GeneratorContext(get_host_target())); });
  expect("only what the generator declares can be set", [&] {
    create()->set_generator_param_values({{"colour", "red"}});
  });
  expect("types are ", [&] { create()->set_generator_param_values({{"out.type", "int7"}}); });
  expect("numbers of dimensions and of elements are whole", [&] {
    create()->set_generator_param_values({{"out.dim", "-1"}});
  });
  expect("the Pipeline has the outputs that generate() defines", [&] { create()->get_pipeline(); });
  expect("all are given, in their order",
         [&] { GeneratorContext(get_host_target()).create<RuleGenerator>()->apply(); });
}

TEST_F(Rules, InputsOfAGeneratorKeepTheirType) {
  const GeneratorContext context(get_host_target());
  expect("the value fits the input's type", [&] { context.create<ByteGenerator>()->apply(300); });
}

TEST_F(Rules, PartsOfACompiledGenerator) {
  const GeneratorContext context(get_host_target());
  const auto generator = context.create<ByteGenerator>();
  generator->apply(3);
  expect("an output has the name that the generator declares",
         [&] { generator->output_funcs("nobody"); });
  expect("its inputs are those of the compiled function", [&] { generator->build_module("g"); });
  expect("gradients are of floating-point outputs",
         [&] { context.create<ByteGenerator>()->build_gradient_module("g"); });
  expect("gradients are of outputs with one value",
         [&] { context.create<RuleGenerator>()->build_gradient_module("g"); });
  expect("gradients are with respect to floating-point inputs",
         [&] { context.create<ByteGenerator>()->build_separate_gradients("g"); });
  const GeneratorFactory factory = [](const GeneratorContext& c) {
    return ByteGenerator::create(c);
  };
  GeneratorRegistry::register_factory("two_of_them", factory);
  GeneratorRegistry::register_factory("two_of_them", factory);
  expect("a name is registered once", [&] { GeneratorRegistry::create("two_of_them", context); });
}

TEST_F(Rules, OneRuntimeForAllTargets) {
  const std::vector<const char*> words{"program", "-r", "runtime",
                                       "-o",      ".",  "target=x86-64-linux,arm-64-linux"};
  std::ostringstream errors;
  EXPECT_NE(internal::generate_filter_main(static_cast<int>(words.size()),
                                           const_cast<char**>(words.data()), errors),
            0);
  expect_mentions(errors.str(), {"one runtime serves all targets"});
}

TEST_F(Rules, CommandLinesOfGenerators) {
  const auto read = [](std::vector<const char*> words) {
    words.insert(words.begin(), "program");
    internal::read_command_line(static_cast<int>(words.size()), words.data());
  };
  expect("its arguments are flags of one letter and param=value", [&] { read({"--help-me"}); });
  expect("every flag has a value", [&] { read({"-g"}); });
  expect("the types of -e are", [&] { read({"-g", "a", "-o", ".", "-e", "poem", "target=host"}); });
}

}  // namespace
}  // namespace retrograde

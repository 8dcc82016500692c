// Errors of generator authors and build files.
#include <gtest/gtest.h>

#include <sstream>

#include "generator/command_line.h"
#include "retrograde/retrograde.h"
#include "support/errors.h"

using namespace retrograde;

namespace {

enum class Mode { Fast, Exact };

class Simple : public Generator<Simple> {
 public:
  GeneratorParam<int> count{"count", 3, 0, 10};
  GeneratorParam<uint8_t> small{"small", 3};
  GeneratorParam<float> weight{"weight", 1.0f};
  GeneratorParam<bool> flag{"flag", false};
  GeneratorParam<Mode> mode{"mode", Mode::Fast, {{"fast", Mode::Fast}, {"exact", Mode::Exact}}};
  GeneratorParam<Type> kind{"kind", Float(32)};
  GeneratorParam<LoopLevel> level{"level", LoopLevel::root()};
  Input<Buffer<>> in{"in", 1};
  Output<Buffer<float, 1>> out{"out"};
  void generate() { out(x) = cast<float>(in(x)); }

 private:
  Var x{"x"};
};

using Params = std::map<std::string, std::string>;

std::string refusal(const std::string& key, const std::string& value) {
  return error_of([&] {
    GeneratorContext(get_host_target())
        .create<Simple>()
        ->set_generator_param_values({{key, value}});
  });
}

TEST(GeneratorErrors, UnknownParamListsThoseThereAre) {
  const std::string text = refusal("cuont", "3");
  expect_mentions(text, {"\"cuont\"", "\"count\", \"flag\", \"in.type\", \"kind\""});
}

// rule: its values are …
TEST(GeneratorErrors, ValuesParseToTheirLastCharacter) {
  for (const char* value : {"", "3x", "3.0", " 3", "+3", "0x3", "three"})
    expect_mentions(refusal("count", value), {"whole numbers from 0 to 10"});
  expect_mentions(refusal("weight", "1.5f"), {"numbers of type float32"});
  expect_mentions(refusal("flag", "yes"), {"\"true\" and \"false\""});
}

TEST(GeneratorErrors, ValuesAreInRange) {
  expect_mentions(refusal("count", "11"), {"out of range"});
  expect_mentions(refusal("small", "256"), {"whole numbers of type uint8"});
  expect_mentions(refusal("small", "-1"), {"whole numbers of type uint8"});
  const GeneratorContext context(get_host_target());
  expect_error({"does not fit"}, [&] { context.create<Simple>()->small.set(300); });
  expect_error({"does not fit"}, [&] { context.create<Simple>()->count.set(2.5); });
}

TEST(GeneratorErrors, EnumerationsListTheirChoices) {
  expect_mentions(refusal("mode", "slow"), {"\"exact\", \"fast\""});
  expect_mentions(refusal("kind", "float"), {"float32, float64"});
  expect_mentions(refusal("level", "out.x"), {"\"root\" and \"inlined\""});
  expect_mentions(refusal("in.type", "uint9"), {"uint8, uint16"});
  expect_mentions(refusal("target", "x87-64-linux"), {"\"x87\""});
  expect_mentions(refusal("machine_params", "16,huge"), {"three numbers"});
}

TEST(GeneratorErrors, AutoschedulersMustBeLoaded) {
  expect_mentions(refusal("auto_schedule", "Adams2019"), {"\"Adams2019\""});
}

// rule: its dimensions are declared once
TEST(GeneratorErrors, DeclarationsAreNotContradicted) {
  expect_mentions(refusal("in.dim", "2"), {"it is declared with 1"});
  expect_mentions(refusal("out.type", "uint8"), {"it is declared as float32"});
}

TEST(GeneratorErrors, OpenTypesMustBeSaidForAModule) {
  expect_error({"in.type="},
               [] { GeneratorContext(get_host_target()).create<Simple>()->build_module(); });
}

// rule: a value is set before generate() reads it
TEST(GeneratorErrors, ParamsAreSetBeforeGenerate) {
  auto simple = GeneratorContext(get_host_target()).create<Simple>();
  simple->apply(Buffer<float>(4));
  expect_error({"generate() has run"}, [&] { simple->count.set(2); });
}

// rule: the value matches the declaration of the input
TEST(GeneratorErrors, InputsFitTheirDeclaration) {
  const GeneratorContext context(get_host_target());
  expect_error({"it has 1 and was given 0"}, [&] { context.apply<Simple>(); });
  expect_error({"declared with 1"}, [&] { context.apply<Simple>(Buffer<float>(4, 4)); });
  Func f("f");
  Var x;
  f(x) = 1.0f;
  expect_error({"given a Func"}, [&] { context.apply<Simple>(f); });
}

class Forgetful : public Generator<Forgetful> {
 public:
  Input<Buffer<float, 1>> in{"in"};
  Output<Buffer<float, 1>> out{"out"};
  void generate() {}
};
class Clashing : public Generator<Clashing> {
 public:
  Input<Buffer<float, 1>> in{"same"};
  Output<Buffer<float, 1>> out{"same"};
  void generate() {}
};
class WrongType : public Generator<WrongType> {
 public:
  Input<Buffer<float, 1>> in{"in"};
  Output<Buffer<float, 1>> out{"out"};
  void generate() {
    Func f("f");
    Var x;
    f(x) = cast<uint8_t>(in(x));
    out = f;
  }
};
class Contradicting : public Generator<Contradicting> {
 public:
  Input<Buffer<float, 1>> in{"in", 2};
  Output<Buffer<float, 1>> out{"out"};
  void generate() {}
};

// Realizes a Func that depends on an input before the input has a value.
class Premature : public Generator<Premature> {
 public:
  Input<Buffer<float, 1>> in{"in"};
  Input<float> gain{"gain"};
  Output<Buffer<float, 1>> out{"out"};
  void generate() {
    Func table("table");
    Var x;
    table(x) = x * gain;
    const Buffer<float> values = table.realize({256});
    out(x) = in(x) + values(x);
  }
};

template <typename G>
std::string refusal_of() {
  return error_of([] { GeneratorContext(get_host_target()).create<G>()->build_module(); });
}

// rule: generate() defines every output
// rule: its params, inputs and outputs have different names
// rule: its type is declared once
TEST(GeneratorErrors, GenerateDefinesWhatIsDeclared) {
  expect_mentions(refusal_of<Forgetful>(), {"\"out\" has no definition"});
  expect_mentions(refusal_of<Clashing>(), {"two are called \"same\""});
  expect_mentions(refusal_of<WrongType>(), {"use uint8 as the type of the output \"out\""});
  expect_mentions(refusal_of<Contradicting>(), {"2 as the dimensions of the input \"in\""});
}

class Misnamed : public Generator<Misnamed> {
 public:
  Input<Buffer<float, 1>> in{"2nd input"};
  Output<Buffer<float, 1>> out{"out"};
  void generate() {}
};
class OneTooFar : public Generator<OneTooFar> {
 public:
  Input<int> shift{"shift"};
  Output<Func[]> outs{"outs", Int(32), 1};
  void generate() {
    outs.resize(2);
    for (size_t i = 0; i < 3; i++) outs[i](x) = x + shift;
  }

 private:
  Var x{"x"};
};

TEST(GeneratorErrors, InputsHaveNoValueInsideOfGenerate) {
  const std::string text = error_of<RuntimeError>(
      [] { GeneratorContext(get_host_target()).create<Premature>()->build_module(); });
  expect_mentions(text, {"\"gain\" needs a value", "none was set"});
}

TEST(GeneratorErrors, NamesAreIdentifiers) {
  const std::string text = refusal_of<Misnamed>();
  expect_mentions(text, {"letters, digits and underscores", "it has the input \"2nd input\""});
}

// rule: elements are counted from 0 to below the array's size
TEST(GeneratorErrors, ElementsOfArraysAreThere) {
  expect_mentions(refusal_of<OneTooFar>(),
                  {"take element 2 of the output \"outs\" of the generator", "its size is 2"});
}

// rule: it is known once it is declared, set or given
// rule: they are known once they are declared, set or given
// rule: it has one value
TEST(GeneratorErrors, OpenDeclarationsHaveNoTypeDimensionsOrSize) {
  class Open : public Generator<Open> {
   public:
    Input<Buffer<>> open{"open"};
    Input<Func> two{"two", std::vector<Type>{Int(32), Int(8)}, 1};
    Output<Func[]> funcs{"funcs"};
    void generate() {}
  };
  const auto made = GeneratorContext(get_host_target()).create<Open>();
  expect_error({"take the type of the input \"open\""}, [&] { made->open.type(); });
  expect_error({"take the dimensions of the input \"open\""}, [&] { made->open.dims(); });
  expect_error({"take the array size of the output \"funcs\""}, [&] { made->funcs.array_size(); });
  expect_error({"it has 2"}, [&] { made->two.type(); });
}

TEST(GeneratorErrors, NumbersFitTheInputsType) {
  class Byte : public Generator<Byte> {
   public:
    Input<uint8_t> level{"level"};
    Output<Buffer<uint8_t, 1>> out{"out"};
    void generate() {
      Var x;
      out(x) = level;
    }
  };
  const GeneratorContext context(get_host_target());
  const std::string text = error_of([&] { context.apply<Byte>(300); });
  expect_mentions(text, {"set the input \"level\" to 300", "its type is uint8"});
}

// rule: a param takes values of its type
TEST(GeneratorErrors, LoopLevelsAreForParamsOfTheirType) {
  auto simple = GeneratorContext(get_host_target()).create<Simple>();
  const std::string text = error_of([&] {
    simple->set_generator_param_values({{"count", LoopLevel::root()}});
  });
  expect_mentions(text, {"set the GeneratorParam \"count\" to \"root\"", "a LoopLevel was given"});
}

class NoOutput : public Generator<NoOutput> {
 public:
  Input<float> in{"in"};
  void generate() {}
};
class TooLate : public Generator<TooLate> {
 public:
  Output<Buffer<float, 1>> out{"out"};
  void generate() { add_input<float>("late"); }
};
class TooEarly : public Generator<TooEarly> {
 public:
  Input<float> in{"in"};
  Output<Buffer<float, 1>> out{"out"};
  void configure() { Expr early = in * 2.0f; }
  void generate() {}
};
class Undefined : public Generator<Undefined> {
 public:
  Output<Buffer<float, 1>> out{"out"};
  void generate() { out = Func("nothing"); }
};

// rule: inputs and outputs are added in configure()
// rule: inputs have values in generate() and schedule()
// rule: the Func has a definition
TEST(GeneratorErrors, EachPhaseHasWhatItMayDo) {
  expect_mentions(refusal_of<NoOutput>(), {"at least one Output"});
  expect_mentions(refusal_of<TooLate>(), {"add the input \"late\" to the generator"});
  expect_mentions(refusal_of<TooEarly>(), {"use the input \"in\" of the generator"});
  expect_mentions(refusal_of<Undefined>(), {"to the output \"out\" of the generator"});
}

// rule: configure() is the place for that
TEST(GeneratorErrors, WhatIsMadeIsTakenAfterwards) {
  auto simple = GeneratorContext(get_host_target()).create<Simple>();
  expect_error({"that generate() defines"}, [&] { simple->get_pipeline(); });
  expect_error({"its outputs are \"out\""}, [&] { simple->output_funcs("off"); });
  simple->apply(Buffer<float>(4));
  expect_error({"Do it in configure()"}, [&] { simple->in.set_type(Float(32)); });
  expect_error({"\"in\" was given a value from C++"}, [&] { simple->build_module(); });
}

TEST(GeneratorErrors, NumbersForOpenPartsAreWholeAndNotNegative) {
  expect_mentions(refusal("in.dim", "-1"), {"set in.dim of the generator"});
  expect_mentions(refusal("in.dim", "two"), {"\"two\" was given"});
}

// rule: its size is set once, and not negative
TEST(GeneratorErrors, SizesOfArraysAreSaidOnce) {
  class Fixed : public Generator<Fixed> {
   public:
    Input<int[2]> in{"in"};
    Output<Buffer<int, 1>> out{"out"};
    void generate() {}
  };
  auto fixed = GeneratorContext(get_host_target()).create<Fixed>();
  const std::string text = error_of([&] { fixed->set_generator_param_values({{"in.size", "3"}}); });
  expect_mentions(text, {"use 3 as the array size of the input \"in\"", "it is 2"});
}

TEST(GeneratorErrors, GradientsAreOfFloats) {
  class Whole : public Generator<Whole> {
   public:
    Input<Buffer<float, 1>> in{"in"};
    Output<Buffer<uint8_t, 1>> out{"out"};
    void generate() {
      Var x;
      out(x) = cast<uint8_t>(in(x));
    }
  };
  auto whole = GeneratorContext(get_host_target()).create<Whole>();
  const std::string text = error_of([&] { whole->build_gradient_module(); });
  expect_mentions(text, {"gradients are of floating-point outputs", "holds uint8"});
}

TEST(GeneratorErrors, SeparateGradientsAreByInputsOfFloats) {
  class OfBytes : public Generator<OfBytes> {
   public:
    Input<Buffer<uint8_t, 1>> in{"in"};
    Output<Buffer<float, 1>> out{"out"};
    void generate() {
      Var x;
      out(x) = cast<float>(in(x));
    }
  };
  auto bytes = GeneratorContext(get_host_target()).create<OfBytes>();
  expect_error({"gradients are with respect to floating-point inputs", "it has none"},
               [&] { bytes->build_separate_gradients(); });
}

TEST(GeneratorErrors, GradientsAreOfOutputsWithOneValue) {
  class Pair : public Generator<Pair> {
   public:
    Input<Buffer<float, 1>> in{"in"};
    Output<Func> out{"out", {Float(32), Float(32)}, 1};
    void generate() {
      Var x;
      out(x) = Tuple(in(x), 2.0f * in(x));
    }
  };
  auto pair = GeneratorContext(get_host_target()).create<Pair>();
  expect_error({"gradients are of outputs with one value"}, [&] { pair->build_gradient_module(); });
  expect_error({"gradients are of outputs with one value"},
               [&] { pair->build_separate_gradients(); });
}

TEST(GeneratorErrors, RequirementsAreConditionsOnParameters) {
  Var x("x");
  Func f("f"), g("g");
  f(x) = x;
  g(x) = f(x) + 1;
  Pipeline pipeline(g);
  expect_error({"uses the Var \"x\""}, [&] { pipeline.add_requirement(x > 3, "x"); });
  expect_error({"it reads \"f"}, [&] { pipeline.add_requirement(f(0) > 3, "f"); });
  Param<int> p("p");
  try {
    pipeline.add_requirement(p + 1, "p");
    FAIL();
  } catch (const CompileError& error) {
    expect_mentions(std::string(error.what()), {"a condition of type bool; it is of type int32"});
  }
}

// ---- the program ----

struct Outcome {
  int status;
  std::string errors;
};

Outcome run(std::vector<std::string> words) {
  words.insert(words.begin(), "program");
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  std::ostringstream errors;
  const int status =
      internal::generate_filter_main(static_cast<int>(argv.size()), argv.data(), errors);
  return {status, errors.str()};
}

void expect_refusal(const Outcome& result, const std::string& phrase) {
  EXPECT_EQ(result.status, 1);
  expect_mentions(result.errors, {"Error: cannot ", phrase, "--help"});
  EXPECT_EQ(result.errors.find("usage: "), std::string::npos) << "buries the error";
}

TEST(GeneratorProgram, NeedsAGeneratorAFolderAndATarget) {
  expect_refusal(run({"target=host"}), "-g names the generator");
  expect_refusal(run({"-g", "simple_for_errors", "target=host"}), "-o names the folder");
  expect_refusal(run({"-g", "simple_for_errors", "-o", "."}), "target= names what to compile for");
}

TEST(GeneratorProgram, TellsItsUsageWhenAsked) {
  const Outcome asked = run({"-g", "complex", "--help"}), bare = run({});
  EXPECT_EQ(asked.status, 0);
  EXPECT_EQ(bare.status, 1);
  for (const Outcome& result : {asked, bare}) {
    expect_mentions(result.errors, {"usage: ", "\"simple_for_errors\""});
  }
}

TEST(GeneratorProgram, RefusesUnknownGenerators) {
  const Outcome result = run({"-g", "complex", "-o", ".", "target=host"});
  expect_refusal(result, "\"complex\"");
  expect_mentions(result.errors, {"\"simple_for_errors\""});
}

TEST(GeneratorProgram, RefusesUnknownFileTypes) {
  const Outcome result =
      run({"-g", "simple_for_errors", "-o", ".", "-e", "object,exe", "target=host"});
  expect_refusal(result, "\"exe\"");
  expect_mentions(result.errors, {"\"static_library\""});
}

TEST(GeneratorProgram, RefusesBadParams) {
  expect_refusal(run({"-g", "simple_for_errors", "-o", ".", "target=host", "cuont=1"}),
                 "\"cuont\"");
  expect_refusal(run({"-g", "simple_for_errors", "-o", ".", "target=host", "count=1.5"}),
                 "\"1.5\"");
  expect_refusal(run({"-g", "simple_for_errors", "-o", ".", "target=host", "auto_schedule=Best"}),
                 "\"Best\"");
}

TEST(GeneratorProgram, RefusesBadTargets) {
  expect_refusal(run({"-g", "simple_for_errors", "-o", ".", "target=x86-64"}), "\"x86-64\"");
}

TEST(GeneratorProgram, RefusesOneRuntimeForMachinesThatDiffer) {
  const Outcome result =
      run({"-r", "rt", "-o", ".", "-e", "object", "target=x86-64-linux,x86-64-linux-debug"});
  EXPECT_EQ(result.status, 1);
  expect_mentions(result.errors,
                  {"make the runtime \"rt\"",
                   "\"x86-64-linux-debug\" and \"x86-64-linux\" need different ones"});
}

TEST(GeneratorProgram, RefusesSeparateGradientsForSeveralTargets) {
  const Outcome result = run({"-g", "simple_for_errors", "-d", "separate", "-o", ".",
                              "target=x86-64-linux-avx2,x86-64-linux"});
  EXPECT_EQ(result.status, 1);
  expect_mentions(result.errors, {"compiled for one target", "2 targets are given"});
}

TEST(GeneratorProgram, RefusesWhatIsNoFlag) {
  expect_refusal(run({"simple_for_errors"}), "\"simple_for_errors\" is neither");
  expect_refusal(run({"-x", "1"}), "\"-x\"");
  expect_refusal(run({"-g"}), "-g has none");
  expect_refusal(run({"-g", "simple_for_errors", "-d", "2", "-o", ".", "target=host"}),
                 "-d takes 1");
  expect_refusal(run({"-t", "soon"}), "-t takes a number");
}

TEST(GeneratorProgram, RefusesPluginsAndSchedulersThatAreNotThere) {
  expect_refusal(run({"-g", "simple_for_errors", "-o", ".", "target=host", "-p", "no_such_plugin"}),
                 "\"no_such_plugin\"");
  expect_refusal(run({"-g", "simple_for_errors", "-o", ".", "target=host", "-s", "Li2018"}),
                 "\"Li2018\"");
}

// Errors of the generator itself are not reported as wrong usage of the command line.
TEST(GeneratorProgram, ReportsAGeneratorsErrorsWithoutUsage) {
  const Outcome result = run({"-g", "simple_for_errors", "-o", ".", "target=host"});
  EXPECT_EQ(result.status, 1);
  expect_mentions(result.errors, {"in.type="});
  EXPECT_EQ(result.errors.find("usage"), std::string::npos);
}

TEST(GeneratorProgram, ReportsAFolderThatCannotBeWritten) {
  const Outcome result = run({"-g", "simple_for_errors", "-o", "no/such/folder", "target=host",
                              "in.type=float32", "-e", "c_header"});
  EXPECT_EQ(result.status, 1);
  expect_mentions(result.errors, {"no/such/folder"});
}

}  // namespace

RETROGRADE_REGISTER_GENERATOR(Simple, simple_for_errors)

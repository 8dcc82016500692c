// Errors of ahead-of-time compilation, which must leave no files behind.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <filesystem>
#include <fstream>

#include "support/errors.h"
#include "support/temporary_folder.h"

namespace retrograde {
namespace {

namespace fs = std::filesystem;

class AotErrors : public testing::Test {
 protected:
  AotErrors() : in(Float(32), 1, "in"), gain("gain"), x("x"), f("f") { f(x) = in(x)*gain; }
  std::string path(const std::string& name) const { return folder / name; }
  bool is_empty() const { return fs::is_empty(folder); }

  const TemporaryFolder temporary;
  const fs::path& folder = temporary.path();
  ImageParam in;
  Param<float> gain;
  Var x;
  Func f;
};

const Target host("host");

TEST_F(AotErrors, ParamThatIsNotListed) {
  expect_error({"\"a\"", "it uses the Param \"gain\", which is not listed", "Add \"gain\""},
               [&] { f.compile_to_file(path("a"), {in}, "a", host); });
  EXPECT_TRUE(is_empty());
}

TEST_F(AotErrors, ImageParamThatIsNotListed) {
  expect_error({"it uses the ImageParam \"in\", which is not listed"},
               [&] { f.compile_to_file(path("a"), {gain}, "a", host); });
}

TEST_F(AotErrors, ArgumentListedTwice) {
  expect_error({"\"in\" is listed twice"}, [&] {
    f.compile_to_file(path("a"), {in, gain, in}, "a", host);
  });
}

TEST_F(AotErrors, ArgumentOfAnotherType) {
  const Argument wrong("gain", Argument::InputScalar, Float(64), 0);
  expect_error({"\"gain\" differs in kind, type or dimensions"}, [&] {
    f.compile_to_file(path("a"), {in, wrong}, "a", host);
  });
}

TEST_F(AotErrors, OutputAmongTheArguments) {
  const Argument output("f", Argument::OutputBuffer, Float(32), 1);
  expect_error({"\"f\" is an output"}, [&] {
    f.compile_to_file(path("a"), {in, gain, output}, "a", host);
  });
}

TEST_F(AotErrors, ScalarWithDimensions) {
  expect_error({"a scalar has none"}, [] { Argument("a", Argument::InputScalar, Float(32), 2); });
}

TEST_F(AotErrors, FolderThatIsNotThere) {
  expect_error({"cannot write", "no/such/a", "folder must exist and be writable",
                "the system says: No such file or directory", "Give a path that can be written"},
               [&] {
                 f.compile_to_file(path("no/such/a"), {in, gain}, "a", host);
               });
}

TEST_F(AotErrors, PathThatIsAFolder) {
  fs::create_directory(path("a.h"));
  expect_error({"a.h\"", "Is a directory"}, [&] {
    f.compile_to_file(path("a"), {in, gain}, "a", host);
  });
  EXPECT_FALSE(fs::exists(path("a.o")));  // a failing call writes no file
}

TEST_F(AotErrors, AFileThatCannotBeWrittenLeavesTheOthersAsTheyWere) {
  std::ofstream(path("a.o")) << "old";
  expect_error({"no/a.h"}, [&] {
    f.compile_to(
        {{OutputFileType::object, path("a.o")}, {OutputFileType::c_header, path("no/a.h")}},
        {in, gain}, "a", host);
  });
  std::string kept;
  std::ifstream(path("a.o")) >> kept;
  EXPECT_EQ(kept, "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
}

TEST_F(AotErrors, NameThatIsNoIdentifier) {
  for (const char* name : {"1st", "a-b", "a b", "::a", "a::"}) {
    expect_error({"a function's name is an identifier"}, [&] {
      f.compile_to_file(path("a"), {in, gain}, name, host);
    });
  }
}

TEST_F(AotErrors, NamespaceInAFunctionOfC) {
  expect_error({"C functions have no namespace", "c_plus_plus_mangling"}, [&] {
    f.compile_to_file(path("a"), {in, gain}, "n::a", host);
  });
}

TEST_F(AotErrors, BufferWithoutData) {
  Buffer<float> shape(nullptr, 8);
  Func g("g");
  g(x) = shape(x);
  expect_error({"a Buffer that is not an argument has data"},
               [&] { g.compile_to_file(path("a"), {}, "a", host); });
}

// ---- unsupported outputs and targets ----

TEST_F(AotErrors, SourceCodeInC) {
  expect_error<Unsupported>({"c_source", "there is no writer", "Write an object"}, [&] {
    f.compile_to_c(path("a.cpp"), {in, gain}, "a", host);
  });
  EXPECT_TRUE(is_empty());
}

TEST_F(AotErrors, WrappersForPyTorchOfWhatItHasNot) {
  Func wide("wide_unsigned");
  wide(x) = cast<uint16_t>(x);
  expect_error<Unsupported>(
      {"PyTorch supports the types of all arguments", "\"wide_unsigned\" holds uint16"}, [&] {
        wide.compile_to({{OutputFileType::pytorch_wrapper, path("a")}}, {}, "a", host);
      });
  expect_error<Unsupported>({"the function's name is a C name", "n::a"}, [&] {
    f.compile_to({{OutputFileType::pytorch_wrapper, path("a")}}, {in, gain}, "n::a",
                 host.with_feature(Target::CPlusPlusMangling));
  });
  EXPECT_TRUE(is_empty());
}

TEST_F(AotErrors, PythonModulesOfScalarsThatPythonHasNot) {
  Param<float16_t> half("half");
  Func wide("wide");
  wide(x) = half;
  expect_error<Unsupported>(
      {"Python supports the scalars' types", "\"half\" is of type float16"}, [&] {
        wide.compile_to({{OutputFileType::python_extension, path("a")}}, {half}, "a", host);
      });
  EXPECT_TRUE(is_empty());
}

TEST_F(AotErrors, OutputsThatOnlyGeneratorsHave) {
  expect_error<Unsupported>({"cpp_stub", "only generators"}, [&] {
    f.compile_to({{OutputFileType::cpp_stub, path("a")}}, {in, gain}, "a", host);
  });
}

TEST_F(AotErrors, TargetsWithoutACodeGenerator) {
  for (const char* name : {"riscv-64-linux", "x86-64-windows", "arm-32-linux", "mips-32-linux",
                           "wasm-32-wasmrt", "x86-64-linux-opencl", "arm-64-linux-sve2"}) {
    expect_error<Unsupported>({name, "\""}, [&] {
      f.compile_to_file(path("a"), {in, gain}, "a", Target(name));
    });
  }
  EXPECT_TRUE(is_empty());
}

// rule: the compiler was built with a runtime
TEST_F(AotErrors, RuntimeForAMachineThatThereIsNoneFor) {
  expect_error<Unsupported>({"add the runtime for target \"mips-32-linux\"", "no_runtime"}, [&] {
    compile_standalone_runtime(path("a.o"), Target("mips-32-linux"));
  });
  EXPECT_TRUE(is_empty());
}

TEST_F(AotErrors, TargetsOfDifferentPlatforms) {
  expect_error({"all targets have the same architecture"}, [&] {
    f.compile_to_multitarget_static_library(path("a"), {in, gain},
                                            {Target("arm-64-linux"), Target("x86-64-linux")});
  });
}

TEST_F(AotErrors, TargetsThatAreCalledDifferently) {
  expect_error({"\"user_context\" is in some of them"}, [&] {
    f.compile_to_multitarget_static_library(
        path("a"), {in, gain}, {Target("x86-64-linux-avx2-user_context"), Target("x86-64-linux")});
  });
}

TEST_F(AotErrors, NoTargets) {
  expect_error({"there must be at least one target"}, [&] {
    f.compile_to_multitarget_static_library(path("a"), {in, gain}, {});
  });
}

TEST_F(AotErrors, SuffixesThatDoNotFit) {
  expect_error({"1 targets and 2 suffixes"}, [&] {
    f.compile_to_multitarget_object_files(path("a"), {in, gain}, {Target("x86-64-linux")},
                                          {"one", "two"});
  });
}

// ---- modules ----

TEST_F(AotErrors, FunctionThatIsNotInTheModule) {
  const Module module = f.compile_to_module({in, gain}, "f", host);
  expect_error({"\"g\"", "it has \"f\""}, [&] { module.get_function_by_name("g"); });
}

// rule: functions of a module have different names
TEST_F(AotErrors, TwoFunctionsOfOneName) {
  Module module = f.compile_to_module({in, gain}, "f", host);
  const internal::LoweredFunc function = module.functions()[0];
  expect_error({"\"f\"", "have different names"}, [&] { module.append(function); });
}

TEST_F(AotErrors, TwoFunctionsOfOneNameInSubmodules) {
  Module both("both", host);
  for (const char* name : {"first", "second"}) {
    Module part(name, host);
    part.append(f.compile_to_module({in, gain}, "twin", host).functions()[0]);
    both.append(part);
  }
  expect_error({"compile the module \"both\"", "a module and its submodules have different names",
                "two are called \"twin\"", "Rename one of them"},
               [&] {
                 both.compile({{OutputFileType::object, path("a.o")}});
               });
  EXPECT_TRUE(is_empty());
}

TEST_F(AotErrors, SubmoduleForAnotherTarget) {
  Module both("both", Target("x86-64-linux"));
  both.append(f.compile_to_module({in, gain}, "wide", Target("x86-64-linux-avx2")));
  expect_error<Unsupported>({"compile the module \"both\"", "are made for one target",
                             "\"wide\" is for \"x86-64-linux-avx", "Compile it by itself"},
                            [&] {
                              both.compile({{OutputFileType::object, path("a.o")}});
                            });
  EXPECT_TRUE(is_empty());
}

TEST_F(AotErrors, LinkedModulesForDifferentTargets) {
  const Module a = f.compile_to_module({in, gain}, "a", Target("x86-64-linux"));
  const Module b = f.compile_to_module({in, gain}, "b", Target("x86-64-linux-avx2"));
  expect_error({"all must be made for one target"}, [&] { link_modules("both", {a, b}); });
}

TEST_F(AotErrors, NothingToLink) {
  expect_error({"there must be at least one"}, [&] { link_modules("none", {}); });
}

}  // namespace
}  // namespace retrograde

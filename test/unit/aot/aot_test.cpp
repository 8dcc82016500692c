// Modules and the files that they are compiled to. (aot_call_test covers the callers' view.)
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "support/temporary_folder.h"

namespace retrograde {
namespace {

namespace fs = std::filesystem;

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// A fixture with a temporary folder and a pipeline.
class AotFiles : public testing::Test {
 protected:
  AotFiles() : in(UInt(8), 2, "in"), gain("gain", 2.0f), x("x"), y("y"), out("brighter") {
    out(x, y) = cast<uint8_t>(min(in(x, y) * gain, 255.0f));
    out.vectorize(x, 8).parallel(y);
  }
  std::string path(const std::string& name) const { return folder / name; }
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder))
      names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }
  int shell(const std::string& command) const {
    return std::system((command + " >" + path("log") + " 2>&1").c_str());
  }
  // Links main.cpp with these files and the system's libraries only.
  int link(const std::vector<std::string>& files) const {
    std::string command = "c++ -std=c++17 " RETROGRADE_TEST_COMPILE_FLAGS " -I" + folder.string() +
                          " " + path("main.cpp");
    for (const std::string& file : files) command += " " + path(file);
    return shell(command + " -o " + path("main") + " -lpthread -ldl");
  }

  const TemporaryFolder temporary;
  const fs::path& folder = temporary.path();
  ImageParam in;
  Param<float> gain;
  Var x, y;
  Func out;
};

TEST_F(AotFiles, EveryKindOfFileInOneCall) {
  out.compile_to({{OutputFileType::object, path("a.o")},
                  {OutputFileType::static_library, path("a.a")},
                  {OutputFileType::c_header, path("a.h")},
                  {OutputFileType::assembly, path("a.s")},
                  {OutputFileType::bitcode, path("a.bc")},
                  {OutputFileType::llvm_assembly, path("a.ll")},
                  {OutputFileType::stmt, path("a.stmt")},
                  {OutputFileType::stmt_html, path("a.html")},
                  {OutputFileType::registration, path("a.cpp")}},
                 {in, gain}, "brighten", Target("host"));
  EXPECT_EQ(read_file(path("a.o")).substr(0, 4), "\177ELF");
  EXPECT_EQ(read_file(path("a.a")).substr(0, 8), "!<arch>\n");
  EXPECT_EQ(read_file(path("a.bc")).substr(0, 2), "BC");
  EXPECT_TRUE(has(read_file(path("a.h")),
                  "int brighten(struct halide_buffer_t *_in_buffer, float _gain, struct "
                  "halide_buffer_t *_brighter"));
  EXPECT_TRUE(has(read_file(path("a.s")), "brighten_argv:"));
  EXPECT_TRUE(has(read_file(path("a.ll")), "define i32 @brighten("));
  EXPECT_TRUE(has(read_file(path("a.stmt")), "parallel for ("));
  EXPECT_TRUE(has(read_file(path("a.cpp")), "halide_register_argv_and_metadata(brighten_argv"));
  EXPECT_EQ(files().size(), 9u);
}

TEST_F(AotFiles, OneFunctionForEachFile) {
  const Target target("host");
  out.compile_to_object(path("b.o"), {in, gain}, "b", target);
  out.compile_to_object(path("b2.o"), {in, gain}, target);
  out.compile_to_header(path("b.h"), {in, gain}, "b", target);
  out.compile_to_assembly(path("b.s"), {in, gain}, "b", target);
  out.compile_to_bitcode(path("b.bc"), {in, gain}, "b", target);
  out.compile_to_llvm_assembly(path("b.ll"), {in, gain}, "b", target);
  out.compile_to_lowered_stmt(path("b.stmt"), {in, gain}, Text, target);
  out.compile_to_lowered_stmt(path("b.html"), {in, gain}, HTML, target);
  EXPECT_EQ(files(), (std::vector<std::string>{"b.bc", "b.h", "b.html", "b.ll", "b.o", "b.s",
                                               "b.stmt", "b2.o"}));
  out.compile_to_file(path("c"), {in, gain}, "c", target);
  out.compile_to_static_library(path("d"), {in, gain}, "d", target);
  for (const char* name : {"c.o", "c.h", "d.a", "d.h"}) EXPECT_TRUE(fs::exists(path(name))) << name;
}

TEST_F(AotFiles, SameProgramSameBytes) {
  out.compile_to_static_library(path("a"), {in, gain}, "same", Target("host"));
  out.compile_to_static_library(path("b"), {in, gain}, "same", Target("host"));
  EXPECT_EQ(read_file(path("a.a")), read_file(path("b.a")));
  EXPECT_EQ(read_file(path("a.h")), read_file(path("b.h")));
}

TEST_F(AotFiles, FilesHaveTheUsualPermissions) {
  out.compile_to_header(path("a.h"), {in, gain}, "a", Target("host"));
  std::ofstream(path("plain")) << "x";
  EXPECT_EQ(fs::status(path("a.h")).permissions(), fs::status(path("plain")).permissions());
}

TEST_F(AotFiles, PageShowsScheduleStatementAndAssembly) {
  out.compile_to_lowered_stmt(path("a.html"), {in, gain}, HTML, Target("host"));
  const std::string page = read_file(path("a.html"));
  const size_t schedule = page.find("<section id=\"schedule\">"),
               statement = page.find("<section id=\"statement\">"),
               assembly = page.find("<section id=\"assembly\">");
  ASSERT_TRUE(schedule < statement && statement < assembly && assembly != std::string::npos);
  EXPECT_TRUE(has(page.substr(schedule, statement - schedule), "brighter"));
  EXPECT_TRUE(has(page, "data-loop=\"" + out.name() + ".s0."));  // a loop of the statement ...
  EXPECT_TRUE(
      has(page, "data-stem=\"" + out.name() + ".s0."));  // ... and its block of machine code
  EXPECT_TRUE(has(page.substr(assembly), "_argv:"));
  EXPECT_FALSE(has(page, "http://") || has(page, "https://"));
}

TEST_F(AotFiles, HeaderIsReadByCAndByCpp) {
  out.compile_to_header(path("a.h"), {in, gain}, "a", Target("host"));
  std::ofstream(path("c.c")) << "#include \"a.h\"\nint main(void) { return a(0, 1, 0); }\n";
  fs::copy_file(path("c.c"), path("cpp.cpp"));
  EXPECT_EQ(shell("cc -std=c99 -Wall -Werror -fsyntax-only " + path("c.c")), 0)
      << read_file(path("log"));
  EXPECT_EQ(shell("c++ -std=c++17 -Wall -Werror -fsyntax-only " + path("cpp.cpp")), 0)
      << read_file(path("log"));
}

// Compiles it against the HalideRuntime.h of Halide 14, which has no such types, ...
TEST_F(AotFiles, FunctionInfoIsConstant) {
  Func pair("pair");
  pair(x, y) = Tuple(cast<float16_t>(in(x, y)), cast<int64_t>(in(x, y)));
  pair.compile_to({{OutputFileType::function_info_header, path("pair.h")}}, {in, gain}, "ns::pair",
                  Target("host-user_context-c_plus_plus_name_mangling"));
  out.compile_to({{OutputFileType::function_info_header, path("out.h")}}, {in, gain}, "out",
                 Target("host"));
  std::ofstream(path("main.cpp")) << R"(#include "pair.h"
#include "out.h"
using namespace HalideFunctionInfo;
constexpr auto infos = ns::pair_argument_info();
static_assert(infos.size() == 5 && infos[0].name == "__user_context");
static_assert(infos[1].name == "in" && infos[1].kind == InputBuffer && infos[1].dimensions == 2);
static_assert(infos[1].type == halide_type_t(halide_type_uint, 8));
static_assert(infos[2].kind == InputScalar && infos[2].dimensions == 0);
static_assert(infos[2].type == halide_type_t(halide_type_float, 32));
static_assert(infos[3].kind == OutputBuffer && infos[3].type == halide_type_t(halide_type_float, 16));
static_assert(infos[4].type == halide_type_t(halide_type_int, 64));
static_assert(out_argument_info().size() == 3);
constexpr ArgumentInfo copy = HalideFunctionInfo::ArgumentInfo(out_argument_info()[2]);
static_assert(copy.kind == HalideFunctionInfo::OutputBuffer);
)";
  const std::string compile = "c++ -std=c++17 -Wall -Wextra -Werror -fsyntax-only ";
  const std::string file = path("main.cpp");
  EXPECT_EQ(shell(compile + RETROGRADE_TEST_COMPILE_FLAGS " " + file), 0) << read_file(path("log"));
  // ... and against that of a release that has them.
  std::ofstream(path("HalideRuntime.h")) << R"(#pragma once
#include_next "HalideRuntime.h"
#define HALIDE_VERSION_MAJOR 21
namespace HalideFunctionInfo {
enum ArgumentKind { InputScalar = 0, InputBuffer = 1, OutputBuffer = 2 };
struct ArgumentInfo { std::string_view name; ArgumentKind kind; int32_t dimensions; halide_type_t type; };
}
)";
  EXPECT_EQ(shell(compile + RETROGRADE_TEST_COMPILE_FLAGS " " + file), 0) << read_file(path("log"));
  EXPECT_NE(shell("c++ -std=c++14 -fsyntax-only " RETROGRADE_TEST_COMPILE_FLAGS " " + file), 0);
  EXPECT_TRUE(has(read_file(path("log")), "function_info headers need C++17"));
}

// test/install/torch_op tests its use with tensors.
TEST_F(AotFiles, WrapperForPyTorchTakesTensorsAndNumbers) {
  out.compile_to({{OutputFileType::pytorch_wrapper, path("a.pytorch.h")}}, {in, gain}, "brighter");
  const std::string text = read_file(path("a.pytorch.h"));
  // A second Func of this name in one process has a number behind it.
  std::string output = out.name();
  std::ranges::replace(output, '$', '_');
  EXPECT_TRUE(
      has(text, "int brighter_th_(const at::Tensor& in, double gain, at::Tensor& " + output + ")"))
      << text;
  EXPECT_TRUE(has(text, "static_cast<float>(gain)"));
  EXPECT_TRUE(has(text, "halide_type_t(halide_type_uint, 8), at::kByte"));
  EXPECT_TRUE(has(text, "(Tensor in, float gain) -> Tensor"));
}

// test/python/python_extension_test.py tests its use with arrays.
TEST_F(AotFiles, PythonModuleDeclaresWhatItCalls) {
  out.compile_to({{OutputFileType::python_extension, path("a.py.cpp")}}, {in, gain}, "brighter");
  const std::string text = read_file(path("a.py.cpp"));
  EXPECT_TRUE(has(text, "int brighter(struct halide_buffer_t *_in_buffer, float _gain,")) << text;
  EXPECT_TRUE(has(text, "names[] = {\"in\", \"gain\", "));
  EXPECT_TRUE(has(text, "#define HALIDE_PYTHON_EXTENSION_FUNCTIONS X(brighter)"));
  compile_standalone_runtime({{OutputFileType::python_extension, path("both.py.cpp")}},
                             Target("host"));
  EXPECT_EQ(files(), (std::vector<std::string>{"a.py.cpp", "both.py.cpp"}));
  EXPECT_TRUE(
      has(read_file(path("both.py.cpp")), "#define HALIDE_PYTHON_EXTENSION_MODULE_NAME both"));
}

TEST_F(AotFiles, SeveralTargetsAsObjects) {
  const Target base("x86-64-linux-no_runtime");
  out.compile_to_multitarget_object_files(
      path("many"), {in, gain}, {base.with_feature(Target::AVX2), base}, {"fast", "base"});
  EXPECT_EQ(files(),
            (std::vector<std::string>{"many-base.o", "many-fast.o", "many.h", "many_wrapper.o"}));
  out.compile_to_multitarget_object_files(path("one"), {in, gain}, {base}, {});
  EXPECT_TRUE(fs::exists(path("one.o")));
}

TEST_F(AotFiles, SeveralTargetsInALibrary) {
  const Target base("x86-64-linux");
  out.compile_to_multitarget_static_library(path("many"), {in, gain},
                                            {base.with_feature(Target::AVX2), base});
  const std::string library = read_file(path("many.a"));
  EXPECT_TRUE(has(library, "retrograde_runtime.o"));
  EXPECT_TRUE(has(library, "many_x86_64_linux_avx2"));
  EXPECT_TRUE(has(library, "halide_can_use_target_features"));
  EXPECT_TRUE(has(read_file(path("many.h")), "int many("));
}

TEST_F(AotFiles, RuntimeByItself) {
  compile_standalone_runtime(path("runtime.o"), Target("host"));
  EXPECT_TRUE(has(read_file(path("runtime.o")), "halide_set_error_handler"));
  const auto written =
      compile_standalone_runtime({{OutputFileType::static_library, path("runtime.a")},
                                  {OutputFileType::c_header, path("runtime.h")}},
                                 Target("host"));
  EXPECT_EQ(written.size(), 1u);
  EXPECT_TRUE(fs::exists(path("runtime.a")));
  EXPECT_FALSE(fs::exists(path("runtime.h")));
}

// As in Halide's build files, the caller links only this library and the system's libraries.
TEST_F(AotFiles, LibraryLinksWithNothingElse) {
  out.compile_to_static_library(path("a"), {in, gain}, "a", Target("host"));
  std::ofstream(path("main.cpp"))
      << "#include \"a.h\"\n#include <HalideBuffer.h>\n"
         "extern \"C\" void halide_error(void*, const char*) { std::exit(7); }\n"
         "int main(int argc, char**) {\n"
         "  Halide::Runtime::Buffer<uint8_t> in(64, 16), out(64, 16);\n"
         "  in.fill(50);\n"
         "  if (argc > 1) return a(nullptr, 3.0f, out);\n"
         "  return a(in, 3.0f, out) == 0 && out(63, 15) == 150 ? 0 : 1;\n}\n";
  ASSERT_EQ(link({"a.a"}), 0) << read_file(path("log"));
  EXPECT_EQ(shell(path("main")), 0);
  // A program's own halide_error replaces the library's.
  EXPECT_EQ(WEXITSTATUS(shell(path("main") + " null")), 7);
}

// A program that ignores error codes must not mistake uncomputed memory for a result.
TEST_F(AotFiles, AnErrorEndsAProgramThatSetsNoHandler) {
  out.compile_to_static_library(path("a"), {in, gain}, "a", Target("host"));
  std::ofstream(path("main.cpp"))
      << "#include \"a.h\"\n#include <HalideBuffer.h>\n#include <cstdio>\n"
         "int main(int argc, char**) {\n"
         "  Halide::Runtime::Buffer<uint8_t> in(60, 16), out(64, 16);\n"
         "  in.fill(50);\n"
         "  if (argc > 1) halide_set_error_handler([](void*, const char*) {});\n"
         "  const int code = a(in, 3.0f, out);\n"
         "  std::puts(\"went on\");\n"
         "  return code == halide_error_code_access_out_of_bounds ? 5 : 6;\n}\n";
  ASSERT_EQ(link({"a.a"}), 0) << read_file(path("log"));
  const int status = shell(path("main"));
  EXPECT_TRUE(WIFSIGNALED(status) ? WTERMSIG(status) == SIGABRT
                                  : WEXITSTATUS(status) == 128 + SIGABRT)
      << status;
  EXPECT_TRUE(has(read_file(path("log")), "Error: ")) << read_file(path("log"));
  EXPECT_FALSE(has(read_file(path("log")), "went on"));
  EXPECT_EQ(WEXITSTATUS(shell(path("main") + " handler")), 5);
}

TEST_F(AotFiles, SeveralTargetsDrawTheSameRandomNumbers) {
  std::vector<std::vector<int>> drawn;
  const auto make = [&](const std::string& name, const Target& target) {
    Func inner, noise("noise");
    inner(x) = random_int();
    noise(x) = random_int() ^ inner(x) ^ random_int(3);
    const Buffer<int> values = noise.realize({4});
    drawn.push_back({values(0), values(1), values(2), values(3)});
    return noise.compile_to_module({}, name, target);
  };
  const Target base("x86-64-linux-no_runtime");
  compile_multitarget("noise", {{OutputFileType::static_library, path("noise.a")}},
                      {base.with_feature(Target::AVX2), base}, {}, make);
  ASSERT_EQ(drawn.size(), 2u);
  EXPECT_EQ(drawn[0], drawn[1]);
  EXPECT_NE(drawn[0][0], drawn[0][1]);
}

// Objects contain the runtime too, and any number of them can be linked together.
TEST_F(AotFiles, ObjectsLinkWithNothingElse) {
  Func twice("twice");
  twice(x, y) = in(x, y) + in(x, y);
  twice.parallel(y);
  out.compile_to_object(path("a.o"), {in, gain}, "a", Target("host"));
  twice.compile_to_object(path("b.o"), {in}, "b", Target("host"));
  twice.compile_to_object(path("c.o"), {in}, "c", Target("host-no_runtime"));
  twice.compile_to_header(path("b.h"), {in}, "b");
  twice.compile_to_header(path("c.h"), {in}, "c");
  out.compile_to_header(path("a.h"), {in, gain}, "a");
  std::ofstream(path("main.cpp"))
      << "#include \"a.h\"\n#include \"b.h\"\n#include \"c.h\"\n#include <HalideBuffer.h>\n"
         "int main() {\n"
         "  Halide::Runtime::Buffer<uint8_t> in(64, 16), out(64, 16);\n"
         "  in.fill(50);\n"
         "  if (a(in, 3.0f, out) != 0 || out(63, 15) != 150) return 1;\n"
         "  if (b(in, out) != 0 || out(63, 15) != 100) return 2;\n"
         "  return c(in, out) == 0 && out(0, 0) == 100 ? 0 : 3;\n}\n";
  ASSERT_EQ(link({"a.o", "b.o", "c.o"}), 0) << read_file(path("log"));
  EXPECT_EQ(shell(path("main")), 0);
  EXPECT_LT(fs::file_size(path("c.o")), fs::file_size(path("b.o")) / 4);
  EXPECT_NE(link({"c.o"}), 0) << "no_runtime leaves the runtime to the caller";
}

// ---- modules ----

TEST_F(AotFiles, ModuleHoldsItsFunction) {
  const Module module = out.compile_to_module({in, gain}, "f", Target("host"));
  EXPECT_EQ(module.name(), "f");
  ASSERT_EQ(module.functions().size(), 1u);
  const internal::LoweredFunc f = module.get_function_by_name("f");
  ASSERT_EQ(f.args.size(), 3u);
  EXPECT_EQ(f.args[0].name, "in");
  EXPECT_TRUE(f.args[2].is_output());
  EXPECT_EQ(f.linkage, LinkageType::ExternalPlusMetadata);
  Buffer<uint8_t> object = module.compile_to_buffer();
  EXPECT_EQ(object(1), 'E');
}

TEST_F(AotFiles, ModuleOutlivesItsPipeline) {
  Module module("", Target("host"));
  {
    Buffer<float> table({4}, "table");
    table.fill(1.0f);
    Func f("f");
    f(x) = table(x);
    module = f.compile_to_module({}, "f", Target("host"));
  }
  EXPECT_GT(module.compile_to_buffer().width(), 100);
}

TEST_F(AotFiles, LinkedModulesAreOneObject) {
  Func other("other");
  other(x) = gain * x;
  const Target target("host-no_runtime");
  const Module both = link_modules("both", {out.compile_to_module({in, gain}, "f", target),
                                            other.compile_to_module({gain}, "g", target)});
  both.compile(
      {{OutputFileType::assembly, path("both.s")}, {OutputFileType::c_header, path("both.h")}});
  EXPECT_TRUE(has(read_file(path("both.s")), "\nf:") && has(read_file(path("both.s")), "\ng:"));
  EXPECT_TRUE(has(read_file(path("both.h")), "int f(") && has(read_file(path("both.h")), "int g("));
}

TEST_F(AotFiles, MetadataNamesCanBeChanged) {
  const Module module = out.compile_to_module({in, gain}, "f", Target("host"));
  module.remap_metadata_name(out.name(), "result");
  EXPECT_EQ(module.get_metadata_name_map().at(out.name()), "result");
  module.compile({{OutputFileType::llvm_assembly, path("f.ll")}});
  EXPECT_TRUE(has(read_file(path("f.ll")), "c\"result\\00\""));
}

TEST_F(AotFiles, LinkageDecidesWhatIsSeen) {
  Pipeline pipeline(out);
  const auto assembly = [&](LinkageType linkage) {
    pipeline.compile_to_module({in, gain}, "f", Target("host"), linkage)
        .compile({{OutputFileType::assembly, path("f.s")}});
    return read_file(path("f.s"));
  };
  EXPECT_FALSE(has(assembly(LinkageType::External), "f_argv"));
  const std::string argv = assembly(LinkageType::ExternalPlusArgv);
  EXPECT_TRUE(has(argv, "f_argv") && !has(argv, "f_metadata"));
  EXPECT_TRUE(has(assembly(LinkageType::ExternalPlusMetadata), "f_metadata"));
}

TEST_F(AotFiles, ParametersBecomeArguments) {
  gain.set_range(0.5f, 4.0f);
  gain.set_estimate(1.5f);
  const Argument a = gain, b = in;
  EXPECT_EQ(a.name, "gain");
  EXPECT_TRUE(a.is_scalar());
  EXPECT_EQ(a.argument_estimates.scalar_def.type(), Float(32));
  EXPECT_TRUE(a.argument_estimates.scalar_max.defined());
  EXPECT_TRUE(b.is_buffer() && b.is_input());
  EXPECT_EQ(b.dimensions, 2);
  EXPECT_EQ(a, Argument(gain));
  EXPECT_FALSE(a == b);
}

// Large programs are compiled in parallel parts. Symbols that the parts share are local, so the
// same program may be linked twice.
TEST_F(AotFiles, PartsOfAProgramAreOneObject) {
  ImageParam samples(Float(32), 1, "samples");
  Buffer<float> ones(6);  // embedded, without a public symbol
  ones.fill(1.0f);
  const auto stages = [&] {
    std::vector<Func> chain;
    for (int i = 0; i < 6; i++) {
      Func next("stage");
      const Expr before = chain.empty() ? samples(x) : chain.back()(x);
      next(x) = sqrt(before * before + 1.0f / (1.0f + before)) + i * ones(i);
      next.compute_root().parallel(x, 64).vectorize(x, 8, TailStrategy::GuardWithIf);
      chain.push_back(next);
    }
    return chain.back();
  };
  Func program = stages();
  program.compile_to_static_library(path("a"), {samples}, "first", Target("host"));
  program.compile_to_object(path("b.o"), {samples}, "second", Target("host-no_runtime"));
  program.compile_to_object(path("c.o"), {samples}, "second", Target("host-no_runtime"));
  EXPECT_EQ(read_file(path("b.o")), read_file(path("c.o")));
  ASSERT_EQ(shell("nm --defined-only --extern-only " + path("b.o")), 0);
  const std::string symbols = read_file(path("log"));
  EXPECT_EQ(std::count(symbols.begin(), symbols.end(), '\n'), 3) << symbols;
  ASSERT_EQ(shell("nm " + path("b.o") + " | grep -c ' t .*parallel'"), 0);
  EXPECT_GE(std::stoi(read_file(path("log"))), 6) << "several functions";
  ASSERT_EQ(shell("readelf -SW " + path("b.o") + " | grep -c 'PROGBITS.* AX '"), 0);
  EXPECT_GE(std::stoi(read_file(path("log"))), 2) << "several parts";

  std::ofstream(path("main.cpp"))
      << "#include <HalideBuffer.h>\n#include <cmath>\n"
         "extern \"C\" int first(halide_buffer_t *, halide_buffer_t *);\n"
         "extern \"C\" int second(halide_buffer_t *, halide_buffer_t *);\n"
         "int main() {\n"
         "  Halide::Runtime::Buffer<float> in(1000), a(1000), b(1000);\n"
         "  for (int i = 0; i < 1000; i++) in(i) = i * 0.01f;\n"
         "  if (first(in, a) || second(in, b)) return 1;\n"
         "  for (int i = 0; i < 1000; i++) {\n"
         "    double v = in(i);\n"
         "    for (int k = 0; k < 6; k++) v = std::sqrt(v * v + 1 / (1 + v)) + k;\n"
         "    if (a(i) != b(i) || std::abs(a(i) - v) > 1e-4 * v) return 2;\n"
         "  }\n"
         "  return 0;\n"
         "}\n";
  ASSERT_EQ(link({"a.a", "b.o"}), 0) << read_file(path("log"));
  EXPECT_EQ(shell(path("main")), 0);
}

TEST_F(AotFiles, CodeForOtherMachines) {
  out.compile_to_file(path("arm"), {in, gain}, "f", Target("arm-64-linux-no_runtime"));
  const std::string object = read_file(path("arm.o"));
  EXPECT_EQ(object[18], static_cast<char>(183));  // e_machine: EM_AARCH64
}

}  // namespace
}  // namespace retrograde

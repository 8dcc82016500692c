// Observing the compiler, from a program and with tools/opt.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "lower/lower.h"
#include "support/temporary_folder.h"

namespace retrograde {
namespace {

namespace fs = std::filesystem;

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

Func make_pipeline() {
  Var x("x");
  Func f("watched");
  f(x) = x * 3 + 1;
  return f;
}

TEST(PassObserver, IsToldOfEveryPass) {
  Func f = make_pipeline();
  std::vector<std::string> passes;
  std::string last;
  double seconds = 0;
  {
    PassObserver observer([&](const PassReport& report) {
      passes.push_back(report.pass);
      seconds += report.seconds;
      if (report.text) last = report.text();
      EXPECT_EQ(report.pipeline, f.name());
    });
    f.compile_jit();
  }
  std::vector<std::string> wanted = lower::pass_names();
  ASSERT_GE(passes.size(), wanted.size());
  EXPECT_TRUE(std::equal(wanted.begin(), wanted.end(), passes.begin()));
  EXPECT_GT(seconds, 0.0);
  EXPECT_TRUE(has(last, "produce"));
}

TEST(PassObserver, IsToldNothingAfterItsEnd) {
  int reports = 0;
  {
    PassObserver observer([&](const PassReport&) { reports++; });
  }
  make_pipeline().compile_jit();
  EXPECT_EQ(reports, 0);
}

TEST(PassObserver, SeesAheadOfTimeCompilationToo) {
  std::set<std::string> passes;
  PassObserver observer([&](const PassReport& report) { passes.insert(report.pass); });
  make_pipeline().compile_to_module({}, "f", Target("host")).compile_to_buffer();
  EXPECT_EQ(passes.count("build_loop_nests"), 1u);
  EXPECT_EQ(passes.count("llvm"), 1u);
}

// ---- tools/opt ----

class Opt : public testing::Test {
 protected:
  // Standard output and error combined.
  std::string opt(const std::string& arguments, int wanted_status = 0) {
    const fs::path out = folder / "out";
    const int status = std::system(
        (std::string(RETROGRADE_OPT) + " " + arguments + " >" + out.string() + " 2>&1").c_str());
    EXPECT_EQ(WEXITSTATUS(status), wanted_status);
    std::ifstream in(out);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::string text_file(const std::string& text, const char* name = "p.graph") {
    std::ofstream(folder / name) << text;
    return (folder / name).string();
  }
  std::string program() {
    std::ofstream(folder / "p.ir") << "unrolled for (f.s0.x, 0, 2) {\n  f[f.s0.x] = 1f + 2f\n}\n";
    return (folder / "p.ir").string();
  }
  const TemporaryFolder temporary;
  const fs::path& folder = temporary.path();
};

TEST_F(Opt, RunsPassesInTheGivenOrder) {
  const std::string result = opt("--pass=unroll_loops,simplify " + program());
  EXPECT_TRUE(has(result, "f[0] = 3f")) << result;
  EXPECT_TRUE(has(result, "f[1] = 3f")) << result;
}

TEST_F(Opt, TimesAndDumpsEveryPass) {
  const std::string result =
      opt("--pass=unroll_loops,simplify --time-passes --dump-after=all " + program());
  EXPECT_TRUE(has(result, "after unroll_loops:\n") && has(result, "after simplify:\n")) << result;
  EXPECT_TRUE(has(result, "total")) << result;
}

TEST_F(Opt, DumpsOneOfSeveral) {
  const std::string result =
      opt("--pass=unroll_loops,simplify --dump-after=unroll_loops " + program());
  EXPECT_TRUE(has(result, "after unroll_loops:\n") && !has(result, "after simplify")) << result;
}

TEST_F(Opt, ShowsWhatAProgramCompiles) {
  const std::string result =
      opt("--time-passes --dump-after=flatten_storage -- " RETROGRADE_THIS_PROGRAM
          " --gtest_filter=PassObserver.IsToldNothingAfterItsEnd");
  EXPECT_TRUE(has(result, "after flatten_storage of watched")) << result;
  for (const std::string& pass : lower::pass_names()) EXPECT_TRUE(has(result, pass)) << pass;
  EXPECT_TRUE(has(result, "llvm_optimize")) << result;
  EXPECT_FALSE(has(result, "after build_loop_nests")) << result;
}

TEST_F(Opt, GivesTheStatusOfTheProgram) {
  opt("-- false", 1);
  opt("-- /no/such/program", 127);
}

TEST_F(Opt, NamesThePasses) {
  EXPECT_TRUE(has(opt("--list"), "unroll_loops\n"));
  EXPECT_TRUE(has(opt("--list-pipeline"), "build_loop_nests\n"));
}

TEST_F(Opt, ReadsGraphsAndLowersThemSoFar) {
  const std::string graph = text_file("func f(x) int32\n  define\n    value (x * 2)\noutput f\n");
  EXPECT_TRUE(has(opt("--graph --pass=apply_wrappers " + graph), "value x * 2\n"));
  EXPECT_TRUE(
      has(opt("--graph --stop-after=build_loop_nests " + graph), "f(f.s0.x) = {f.s0.x * 2}"));
  const std::string log = text_file("f.split(x, xo, xi, 4, RoundUp)\n", "p.log");
  EXPECT_TRUE(has(opt("--graph --log=" + log + " " + graph), "split(x, xo, xi, 4, RoundUp)\n"));
  EXPECT_TRUE(has(opt("--graph --pass=simplify " + graph, 1), "from graph to graph"));
  EXPECT_TRUE(has(opt("--graph --pass=build_loop_nests " + graph), "f(f.s0.x) = {f.s0.x * 2}"));
  EXPECT_TRUE(has(opt("--graph --pass=fork_async " + graph, 1), "start from a statement"));
  const std::string both = text_file(
      "func f(x) int32\n  define\n    value x\noutput f\nstatement\nf(0) = {(1 + 2)}\n", "p.both");
  EXPECT_TRUE(has(opt("--graph --pass=flatten_storage " + both), "f[(0 - f.min.0) * f.stride.0"));
  EXPECT_TRUE(has(opt("--graph --stop-after=nothing " + graph, 1),
                  "lowering stops after one of its passes"));
}

TEST_F(Opt, RefusesWhatItDoesNotKnow) {
  EXPECT_TRUE(has(opt("--pass=no_such_pass " + program(), 1), "\"no_such_pass\""));
  EXPECT_TRUE(has(opt("--what", 2), "usage"));
}

}  // namespace
}  // namespace retrograde

// Every golden/pipeline/<pass>/<case>.in, the text of a program (tools/opt/program_text.h), through its pass must give
// <case>.out. RETROGRADE_UPDATE_GOLDEN=1 writes the .out files instead; read the difference before you commit it.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "diagnostics/error.h"
#include "ir/print.h"
#include "lower/lower.h"
#include "lower/statement_passes.h"
#include "program_text.h"
#include "support/golden_files.h"
#include "support/same_numbers.h"

namespace retrograde::lower {
namespace {

namespace fs = std::filesystem;

const fs::path golden = fs::path(RETROGRADE_TEST_DIR) / "golden";

// The expected output of a pass that must reject its input is the message.
std::string outcome(const std::string& pass, const opt::ProgramText& program) {
  try {
    return same_numbers(opt::text_after(pass, program));
  } catch (const UserError& e) {
    return text("error: ", e.what(), "\n");
  }
}

class PipelineGolden : public testing::TestWithParam<fs::path> {};

TEST_P(PipelineGolden, GivesWhatItsFileSays) {
  const std::string pass = GetParam().parent_path().filename().string();
  const opt::ProgramText program =
      opt::parse_program(read_file(GetParam()), Target("x86-64-linux-avx2"));
  const std::string result = outcome(pass, program);
  fs::path expected = fs::path(GetParam()).replace_extension(".out");
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) std::ofstream(expected) << result;
  EXPECT_EQ(result, read_file(expected));
}

INSTANTIATE_TEST_SUITE_P(Cases, PipelineGolden,
                         testing::ValuesIn(files_below(golden / "pipeline", ".in")),
                         [](const auto& info) {
                           return info.param.parent_path().filename().string() + "_" +
                                  info.param.stem().string();
                         });

// Each pass of the compiler, and each that opt can run alone, has a case: either from statement to
// statement, or from a graph.
TEST(PassesOfThePipeline, AreAllTested) {
  std::vector<std::string> names = pass_names();
  for (const StatementPass& pass : statement_passes()) names.push_back(pass.name);
  for (const std::string& name : names) {
    const bool is_simplify =
        name.rfind("simplify", 0) == 0;  // of storage, of vectors: the same pass
    const std::string folder = is_simplify ? "simplify" : name;
    EXPECT_TRUE(fs::exists(golden / "lower" / folder) || fs::exists(golden / "pipeline" / folder))
        << name << " has no golden test";
  }
}

}  // namespace
}  // namespace retrograde::lower

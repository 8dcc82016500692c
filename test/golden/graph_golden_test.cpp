// Every golden/graph/<pass>/<case>.in, the text of a graph, through its pass must give <case>.out.
// If there is a <case>.log, its directives are applied by the pass (opt --graph --log=FILE).
// RETROGRADE_UPDATE_GOLDEN=1 writes the .out files instead; read the difference before you commit
// it.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "graph/directives/schedule_log.h"
#include "graph/graph.h"
#include "graph_passes.h"
#include "support/golden_files.h"
#include "support/same_numbers.h"

namespace retrograde::opt {
namespace {

namespace fs = std::filesystem;

class GraphGolden : public ::testing::TestWithParam<fs::path> {};

std::vector<FuncPtr> passed(const fs::path& input, const std::vector<FuncPtr>& outputs) {
  const fs::path log = fs::path(input).replace_extension(".log");
  if (fs::exists(log)) return with_log(ScheduleLog::parse(read_file(log)), outputs);
  const GraphPass* pass = find_graph_pass(input.parent_path().filename().string());
  return pass ? pass->run(outputs) : throw std::invalid_argument("there is no such pass");
}

TEST_P(GraphGolden, GivesWhatItsFileSays) {
  const Graph before = parse_graph(read_file(GetParam()));
  validate(before, "parse_graph");
  const std::string text = to_text(before);
  const Graph after = graph_of(passed(GetParam(), before.outputs));
  validate(after, GetParam().parent_path().filename().string());
  EXPECT_EQ(to_text(before), text) << "the pass changed its input";
  EXPECT_EQ(difference(parse_graph(to_text(after)), after), "");

  fs::path expected = GetParam();
  expected.replace_extension(".out");
  const std::string result = same_numbers(to_text(after));
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) std::ofstream(expected) << result;
  EXPECT_EQ(result, read_file(expected));
}

INSTANTIATE_TEST_SUITE_P(
    Cases, GraphGolden,
    ::testing::ValuesIn(files_below(fs::path(RETROGRADE_TEST_DIR) / "golden/graph", ".in")),
    [](const auto& info) {
      return info.param.parent_path().filename().string() + "_" + info.param.stem().string();
    });

// Each pass has a case.
TEST(GraphPasses, AreAllTested) {
  for (const GraphPass& pass : graph_passes())
    EXPECT_TRUE(fs::exists(fs::path(RETROGRADE_TEST_DIR) / "golden/graph" / pass.name))
        << pass.name;
}

}  // namespace
}  // namespace retrograde::opt

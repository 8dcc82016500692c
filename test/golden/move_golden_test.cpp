// Every golden/moves/<move>/<case>.in, a graph with a plan (tools/opt/move_text.h), must give the plans in <case>.out by
// its move. RETROGRADE_UPDATE_GOLDEN=1 writes the .out files instead; read the difference before you commit it.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "autoschedule/moves/move.h"
#include "graph/graph.h"
#include "move_text.h"
#include "support/golden_files.h"
#include "support/same_numbers.h"

namespace retrograde {
namespace {

namespace fs = std::filesystem;

size_t parallel_loops(const std::string& plans) {
  size_t count = 0;
  for (size_t at = 0; (at = plans.find("parallel ", at)) != std::string::npos; ++at) ++count;
  return count;
}

class MoveGolden : public ::testing::TestWithParam<fs::path> {};

TEST_P(MoveGolden, GivesWhatItsFileSays) {
  const opt::MoveText input = opt::split_move(read_file(GetParam()));
  const std::string move = GetParam().parent_path().filename().string();
  const std::string result =
      same_numbers(opt::plans_after(move, input, graph::parse_graph(input.graph).outputs));
  fs::path expected = GetParam();
  expected.replace_extension(".out");
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) std::ofstream(expected) << result;
  EXPECT_EQ(result, read_file(expected));
}

INSTANTIATE_TEST_SUITE_P(
    Cases, MoveGolden,
    ::testing::ValuesIn(files_below(fs::path(RETROGRADE_TEST_DIR) / "golden/moves", ".in")),
    [](const auto& info) {
      return info.param.parent_path().filename().string() + "_" + info.param.stem().string();
    });

// Programs whose loops become parallel if there are more threads.
TEST(Moves, MakeNoLoopParallelForOneThread) {
  for (const std::string name : {"parallelise/rows_or_strips", "parallelise/columns_of_a_scan",
                                 "root/from_the_loop_of_its_consumer"}) {
    const fs::path file = fs::path(RETROGRADE_TEST_DIR) / "golden/moves" / (name + ".in");
    const opt::MoveText input = opt::split_move(read_file(file));
    const auto given = [&](int threads) {
      const std::string move = file.parent_path().filename().string();
      return opt::plans_after(move, input, graph::parse_graph(input.graph).outputs, threads);
    };
    EXPECT_GT(parallel_loops(given(2)), parallel_loops(input.plan)) << name;
    EXPECT_LE(parallel_loops(given(1)), parallel_loops(input.plan)) << name;
  }
}

TEST(Moves, AreAllTested) {
  for (const planning::Move& move : planning::all_moves())
    EXPECT_TRUE(fs::exists(fs::path(RETROGRADE_TEST_DIR) / "golden/moves" / move.name))
        << move.name;
}

}  // namespace
}  // namespace retrograde

// The schedule of every golden/graph/schedule_unscheduled/<case>.out, as a plan, is golden/plan/<case>.out, and the plan's
// directives give that plan again.
// RETROGRADE_UPDATE_GOLDEN=1 writes the .out files instead; read the difference before you commit
// it.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "graph/graph.h"
#include "support/golden_files.h"
#include "support/plan_round_trip.h"

namespace retrograde {
namespace {

namespace fs = std::filesystem;

class PlanGolden : public ::testing::TestWithParam<fs::path> {};

TEST_P(PlanGolden, GivesWhatItsFileSays) {
  const graph::Graph graph = graph::parse_graph(read_file(GetParam()));
  const std::vector<graph::FuncPtr> outputs = graph::apply_wrappers(graph.outputs);
  const std::string result = same_numbers(to_text(planning::import_plan(outputs)));
  const fs::path expected = fs::path(RETROGRADE_TEST_DIR) / "golden/plan" / GetParam().filename();
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) std::ofstream(expected) << result;
  EXPECT_EQ(result, read_file(expected));

  const PlanRoundTrip trip = plan_round_trip(outputs, get_host_target(), "");
  EXPECT_EQ(trip.failure, "");
  EXPECT_EQ(trip.broken, "");
  EXPECT_TRUE(trip.opaque.empty());
}

INSTANTIATE_TEST_SUITE_P(Cases, PlanGolden,
                         ::testing::ValuesIn(files_below(fs::path(RETROGRADE_TEST_DIR) /
                                                             "golden/graph/schedule_unscheduled",
                                                         ".out")),
                         [](const auto& info) { return info.param.stem().string(); });

}  // namespace
}  // namespace retrograde

// Random moves on random programs. test/property/fuzz_moves.cpp runs any others, and shrinks what it finds.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "driver/schedule.h"
#include "graph/graph.h"
#include "lower/lower.h"
#include "support/golden_files.h"
#include "support/move_walk.h"
#include "support/program_counts.h"

namespace retrograde::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t walks = many_or_few(1000, 100);

TEST(MoveWalks, GivePlansThatComputeTheSame) {
  std::map<std::string, uint64_t> moves;
  uint64_t illegal = 0;
  for (uint64_t seed = 1; seed <= walks; ++seed) {
    try {
      Choices choices(seed);
      MoveWalk walk(choices);
      walk.run();
      const Judged judged = walk.judge(get_jit_target_from_environment());
      for (const auto& [name, count] : judged.counts) moves[name] += count;
      illegal += judged.judgement == Judgement::Illegal;
      EXPECT_TRUE(judged.judgement == Judgement::Right || judged.judgement == Judgement::Illegal)
          << "seed " << seed << ": " << judged.detail << "\n"
          << walk.text() << "Shrink it: fuzz_moves --seed " << seed;
    } catch (const UserError&) {
      ++illegal;  // the program
    }
  }
  EXPECT_LT(illegal, walks / 4);
  for (const planning::Move& move : planning::all_moves()) {
    if (takes_many) EXPECT_GT(moves[move.name], 0u) << move.name;
    std::cout << move.name << " " << moves[move.name] << "\n";
  }
}

// Moves on the default schedules of programs: their plans have windows, loops that stages share, lanes of sums. Each plan
// that is taken lowers. RETROGRADE_PLAN_GRAPHS names a folder of more programs.
class ScheduledGraph : public ::testing::TestWithParam<fs::path> {};

// The error of lowering; empty: none.
std::string lowering_error(const planning::Plan& plan) {
  const std::vector<graph::FuncPtr> outputs = emit_plan(plan);
  try {
    lower::lower("moved", outputs, lower::infer_arguments(outputs), {.target = get_host_target()});
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST_P(ScheduledGraph, KeepsLoweringAfterMoves) {
  const graph::Graph graph = graph::parse_graph(read_file(GetParam()));
  const std::vector<graph::FuncPtr> outputs =
      graph::apply_wrappers(driver::schedule_unscheduled(graph.outputs));
  planning::Plan plan = planning::import_plan(outputs);
  ASSERT_EQ(broken_invariant(plan), "");
  // Some programs have an index without a range, which bounds inference refuses.
  if (!lowering_error(plan).empty()) GTEST_SKIP() << lowering_error(plan);
  const planning::AccessGraph accesses(outputs);
  const planning::SizeModel sizes(accesses, {planning::unknown_extent});
  planning::Dependences dependences(accesses);
  const planning::Machine machine;
  planning::CostModel cost(accesses, sizes, machine);
  const auto moves = planning::all_moves();
  Choices choices(1);
  std::string trace = "\n" + to_text(plan);
  for (int step = 0; step < many_or_few(60, 20) && !HasFailure(); ++step) {
    const auto id =
        static_cast<planning::FuncId>(choices.below(static_cast<int>(plan.funcs.size())));
    const planning::Move& move = moves[static_cast<size_t>(choices.below(int(moves.size())))];
    const std::vector<planning::Plan> plans =
        move.apply(plan, id, {accesses, sizes, machine, dependences});
    if (plans.empty()) continue;
    plan = choices.pick(plans);
    trace += retrograde::text("\n", move.name, " of ", plan.program->funcs[size_t(id)]->name, "\n",
                              to_text(plan));
    EXPECT_EQ(broken_invariant(plan), "") << trace;
    for (const planning::Plan& other : plans)
      EXPECT_EQ(price_difference(cost, other, {accesses, sizes, machine, dependences}), "");
    EXPECT_EQ(lowering_error(plan), "") << trace;
  }
}

std::vector<fs::path> graphs() {
  const char* folder = std::getenv("RETROGRADE_PLAN_GRAPHS");
  const fs::path golden = fs::path(RETROGRADE_TEST_DIR) / "golden/graph/schedule_unscheduled";
  return folder ? files_below(folder, ".graph") : files_below(golden, ".in");
}
INSTANTIATE_TEST_SUITE_P(Cases, ScheduledGraph, ::testing::ValuesIn(graphs()),
                         [](const auto& info) {
                           std::string name = info.param.stem().string();
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace retrograde::fuzz

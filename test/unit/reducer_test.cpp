// The reducer on programs whose "failure" is a property of their description.
#include "testing/reducer.h"

#include <gtest/gtest.h>

#include "testing/print_program.h"

namespace retrograde::fuzz {
namespace {

int count_terms(const Program& program, Action action) {
  int count = 0;
  const std::vector<bool> reachable = reachable_funcs(program.pipeline);
  for (size_t f = 0; f < program.pipeline.funcs.size(); ++f) {
    const FuncSpec& func = program.pipeline.funcs[f];
    for (size_t s = 0; reachable[f] && s <= func.updates.size(); ++s) {
      for_each_term_of_stage(func, static_cast<int>(s),
                             [&](const Term& term) { count += term.action == action; });
    }
  }
  return count;
}

int count_directives(const Program& program) {
  int count = 0;
  for (const FuncScheduleSpec& func : program.schedule.funcs) {
    for (const StageSpec& stage : func.stages) count += static_cast<int>(stage.directives.size());
  }
  return count;
}

Program first_program_with(const StillFails& property) {
  for (int seed = 0; seed < 1000; ++seed) {
    Program program{random_pipeline(seed), {}};
    program.schedule = random_schedule(program.pipeline, seed);
    if (property(program)) return program;
  }
  return {};
}

TEST(Reducer, KeepsThePropertyAndLittleElse) {
  const StillFails fails = [](const Program& p) {
    return count_terms(p, Action::Div) >= 1 && count_directives(p) >= 2;
  };
  const Program program = first_program_with(fails);
  ASSERT_FALSE(program.pipeline.funcs.empty());
  const Program small = shrink(program, fails);
  EXPECT_TRUE(fails(small));
  EXPECT_EQ(count_terms(small, Action::Div), 1) << to_cpp(small.pipeline, small.schedule);
  EXPECT_EQ(count_directives(small), 2);
  EXPECT_EQ(small.pipeline.outputs.size(), 1u);
  for (const FuncSpec& func : small.pipeline.funcs) EXPECT_TRUE(func.updates.empty());
}

TEST(RandomPrograms, AreReproducible) {
  for (int seed = 0; seed < 20; ++seed) {
    const PipelineSpec a = random_pipeline(seed), b = random_pipeline(seed);
    EXPECT_EQ(to_cpp(a, random_schedule(a, seed)), to_cpp(b, random_schedule(b, seed)));
  }
}

// Over many seeds every construct occurs: a generator that silently stopped making one would leave
// it untested.
TEST(RandomPrograms, CoverEveryAction) {
  std::vector<int> seen(static_cast<int>(Action::Maximum) + 1);
  for (int seed = 0; seed < 400; ++seed) {
    const Program program{random_pipeline(seed), {}};
    for (size_t a = 0; a < seen.size(); ++a) {
      seen[a] += count_terms(program, static_cast<Action>(a));
    }
  }
  for (size_t a = 0; a < seen.size(); ++a) EXPECT_GT(seen[a], 0) << "action " << a;
}

TEST(RandomPrograms, CoverEveryDirectiveAndPlacement) {
  std::vector<int> directives(6), placements(4);
  for (int seed = 0; seed < 200; ++seed) {
    const PipelineSpec pipeline = random_pipeline(seed);
    for (const FuncScheduleSpec& func : random_schedule(pipeline, seed).funcs) {
      ++placements[static_cast<int>(func.placement.where)];
      for (const StageSpec& stage : func.stages) {
        for (const Directive& d : stage.directives) ++directives[static_cast<int>(d.kind)];
      }
    }
  }
  for (const int count : directives) EXPECT_GT(count, 10);
  for (const int count : placements) EXPECT_GT(count, 10);
}

}  // namespace
}  // namespace retrograde::fuzz

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
  std::vector<int> seen(static_cast<int>(Action::ArgMax) + 1);
  for (int seed = 0; seed < 400; ++seed) {
    const Program program{random_pipeline(seed), {}};
    for (size_t a = 0; a < seen.size(); ++a) {
      seen[a] += count_terms(program, static_cast<Action>(a));
    }
  }
  for (size_t a = 0; a < seen.size(); ++a) EXPECT_GT(seen[a], 0) << "action " << a;
}

struct Census {
  std::vector<int> directives = std::vector<int>(Directive::kinds);
  std::vector<int> placements = std::vector<int>(4), derived = std::vector<int>(4);
  std::vector<int> rules = std::vector<int>(DimensionRule::kinds);
  int stored_outside = 0, hoisted = 0, memoized = 0, async = 0, traced = 0, reordered = 0, heap = 0;
  int companions = 0;

  void count(const std::vector<Directive>& list) {
    for (const Directive& d : list) {
      ++directives[static_cast<int>(d.kind)];
      count(d.nested);
    }
  }
  void count(const FuncScheduleSpec& func) {
    ++placements[static_cast<int>(func.placement.where)];
    for (const StageSpec& stage : func.stages) count(stage.directives);
    for (const DimensionRule& rule : func.rules) ++rules[static_cast<int>(rule.kind)];
    stored_outside += !func.placement.store_loop.empty();
    hoisted += !func.placement.hoist_loop.empty();
    memoized += func.memoized;
    async += func.async;
    traced += func.traced;
    reordered += !func.storage_order.empty();
    heap += func.memory == MemoryType::Heap;
  }
};

TEST(RandomPrograms, CoverEveryDirectiveAndPlacement) {
  Census census;
  for (int seed = 0; seed < 400; ++seed) {
    const ScheduleSpec schedule = random_schedule(random_pipeline(seed), seed);
    for (const FuncScheduleSpec& func : schedule.funcs) census.count(func);
    for (const DerivedFunc& d : schedule.derived) ++census.derived[static_cast<int>(d.kind)];
    census.companions += static_cast<int>(schedule.companions.size());
  }
  for (const auto* counts : {&census.directives, &census.placements, &census.rules}) {
    for (size_t i = 0; i < counts->size(); ++i) EXPECT_GT((*counts)[i], 5) << i;
  }
  for (size_t i = 1; i < census.derived.size(); ++i) EXPECT_GT(census.derived[i], 5) << i;
  for (const int count : {census.stored_outside, census.hoisted, census.memoized, census.async,
                          census.traced, census.reordered, census.heap, census.companions}) {
    EXPECT_GT(count, 5);
  }
}

}  // namespace
}  // namespace retrograde::fuzz

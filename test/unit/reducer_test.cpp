// The reducer on programs whose "failure" is a property of their description.
#include "testing/reducer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

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
  return static_cast<int>(
      std::count_if(program.schedule.entries.begin(), program.schedule.entries.end(),
                    [](const ScheduleLog::Entry& entry) { return is_of_stage(entry.directive); }));
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

TEST(RandomPrograms, CoverEveryDirectiveAndPlacement) {
  std::map<std::string, int> seen;
  for (int seed = 0; seed < 400; ++seed) {
    for (const ScheduleLog::Entry& entry : random_schedule(random_pipeline(seed), seed).entries) {
      std::string name = name_of(entry.directive);
      if (const auto* run = std::get_if<ir::RunLoop>(&entry.directive))
        name += std::to_string(static_cast<int>(run->kind));
      if (const auto* at = std::get_if<ir::ComputeAt>(&entry.directive))
        name += std::to_string(static_cast<int>(at->level.kind));
      ++seen[name + (entry.special.empty() ? "" : " of a specialization")];
    }
  }
  // What changes nothing that a program computes.
  const std::set<std::string> without{"unscheduled",   "set_estimate", "add_trace_tag",
                                      "debug_to_file", "run",          "compute_at"};
  std::vector<std::string> wanted = ir::directive_names();
  std::erase_if(wanted, [&](const std::string& name) { return without.count(name) != 0; });
  wanted.insert(wanted.end(), {"run0", "run1", "run2", "run3", "compute_at0", "compute_at1",
                               "compute_at2", "split of a specialization",
                               "run2 of a specialization", "reorder of a specialization"});
  for (const std::string& name : wanted) EXPECT_GT(seen[name], 5) << name;
}

}  // namespace
}  // namespace retrograde::fuzz

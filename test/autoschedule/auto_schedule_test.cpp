// Random pipelines under Pipeline::auto_schedule: schedules are legal and results are right. A program that is refused
// is also refused without a schedule.
#include <gtest/gtest.h>

#include <set>

#include "frontend/run/pipeline.h"
#include "ir/target.h"
#include "support/program_counts.h"
#include "testing/check_program.h"
#include "testing/random_schedule.h"

namespace retrograde::fuzz {
namespace {

constexpr uint64_t first_seed = 7000;
constexpr int programs_per_shard = 40;
constexpr int shards = 4;
// Programs without a schedule, and partly scheduled ones.
constexpr int step = many_or_few(1, 4);  // 160, or 40: every fourth shard

// The directives for half of the Funcs, and for the Funcs generated from these.
ScheduleLog part_of(const ScheduleLog& log, Choices& choices) {
  ScheduleLog part;
  std::set<std::string> seen, kept;
  for (const ScheduleLog::Entry& entry : log.entries) {
    if (seen.insert(entry.func).second && choices.below(2) == 0) kept.insert(entry.func);
    if (!kept.count(entry.func)) continue;
    part.entries.push_back(entry);
    if (const std::string made = graph::made_by(entry.directive); !made.empty()) {
      seen.insert(made);
      kept.insert(made);
    }
  }
  return part;
}

struct Built {
  RandomProgram program;
  ScheduleLog schedule;  // a partial schedule, or none
};
Built build(uint64_t seed, bool has_schedule) {
  Choices choices(seed);
  Built built{make_program(choices, Style::pipelines()), {}};
  if (has_schedule) built.schedule = part_of(random_schedule(built.program, choices), choices);
  return built;
}

// Returns the number of compared values. An unscheduled program may recompute its producers many times, so it runs only
// if the result under auto_schedule is wrong.
uint64_t check(uint64_t seed, bool has_schedule) {
  const Target target = get_jit_target_from_environment();
  const Built built = build(seed, has_schedule);
  std::string source;
  bool is_scheduled = false;
  Judged judged = check_with_schedule(
      built.program,
      [&] {
        apply(built.schedule, built.program);
        source = Pipeline(built.program.outputs).auto_schedule(target).schedule_source;
        is_scheduled = true;
      },
      target);
  EXPECT_TRUE(has_schedule || is_scheduled) << "seed " << seed << ": " << judged.detail;
  if (judged.judgement == Judgement::Right) return judged.counts["values"];
  const Built alone = build(seed, has_schedule);
  const Judgement as_it_is = check_program(alone.program, alone.schedule, target).judgement;
  if (has_schedule && as_it_is != Judgement::Right) return 0;
  EXPECT_LE(judged.judgement, as_it_is)
      << "seed " << seed << " is " << name_of(judged.judgement) << ": " << judged.detail << "\n"
      << to_text(built.program, built.schedule) << "auto_schedule gave\n"
      << source;
  return judged.counts["values"];
}

class AutoSchedule : public ::testing::TestWithParam<int> {};

TEST_P(AutoSchedule, IsLegalAndRight) {
  uint64_t compared = 0;
  for (int i = 0; i < programs_per_shard; ++i) {
    const auto seed = first_seed + static_cast<uint64_t>(GetParam() * programs_per_shard + i);
    compared += check(seed, false);
    compared += check(seed, true);
  }
  EXPECT_GT(compared, 100u * programs_per_shard);
}

INSTANTIATE_TEST_SUITE_P(Shard, AutoSchedule, ::testing::Range(0, shards, step));

}  // namespace
}  // namespace retrograde::fuzz

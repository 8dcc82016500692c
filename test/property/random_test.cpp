// Random pipelines under random schedules: machine code agrees with the interpreter.
//
// Bit for bit, except floats whose value depends on roundings that a compiler may move (contraction
// to FMA, ULP of math functions): those within twice the error bound that the interpreter derives
// for each element (testing/tracked_value.h). Seeds are fixed; test/property/fuzz.cpp goes on from
// here with any others, and shrinks what fails.
#include <gtest/gtest.h>

#include "ir/target.h"
#include "testing/check_program.h"
#include "testing/print_program.h"
#include "testing/random_schedule.h"

namespace retrograde::fuzz {
namespace {

constexpr int programs_per_shard = 20;
constexpr int shards = 16;                     // 320 programs
constexpr double max_refused_fraction = 0.15;  // of one shard
constexpr double max_unstable_fraction = 0.1;

// Whether it was refused.
bool expect_agreement(const PipelineSpec& pipeline, const ScheduleLog& schedule, int seed,
                      Outcome& total) {
  const Outcome outcome = check_program(pipeline, schedule, get_jit_target_from_environment());
  total.compared += outcome.compared;
  total.unstable += outcome.unstable;
  if (outcome.verdict == Verdict::Refused) return true;
  EXPECT_EQ(outcome.verdict, Verdict::Agrees)
      << "seed " << seed << " " << verdict_name(outcome.verdict) << ": " << outcome.detail << "\n"
      << to_cpp(pipeline, schedule) << "Shrink it: fuzz_pipelines --seed " << seed;
  return false;
}

class RandomPrograms : public ::testing::TestWithParam<int> {};

TEST_P(RandomPrograms, MachineCodeAgreesWithTheInterpreter) {
  Outcome total;
  int refused = 0;
  for (int i = 0; i < programs_per_shard; ++i) {
    const int seed = GetParam() * programs_per_shard + i;
    const PipelineSpec pipeline = random_pipeline(seed);
    refused += expect_agreement(pipeline, random_schedule(pipeline, seed), seed, total);
  }
  EXPECT_LE(refused, max_refused_fraction * programs_per_shard);
  EXPECT_GT(total.compared, 0u);
  EXPECT_LE(total.unstable, max_unstable_fraction * total.compared);
}

INSTANTIATE_TEST_SUITE_P(Shard, RandomPrograms, ::testing::Range(0, shards));

}  // namespace
}  // namespace retrograde::fuzz

// Random pipelines under random schedules: machine code agrees with the interpreter.
//
// Results agree bit for bit, except floats that depend on roundings that a compiler may change (contraction to FMA, ULP
// of math functions). These must be within twice the error bound that the interpreter derives for each element
// (testing/tracked_value.h).
//
// Seeds are fixed; test/property/fuzz.cpp runs any others, and shrinks failing programs. Three of four programs check
// their accesses. The fourth is compiled as for users, with buffers where an access beyond a block is a crash.
#include <gtest/gtest.h>

#include "ir/target.h"
#include "support/program_counts.h"
#include "testing/check_program.h"
#include "testing/random_schedule.h"

namespace retrograde::fuzz {
namespace {

constexpr uint64_t first_seed = 1000;
constexpr int programs_per_shard = 50;
constexpr int shards = 4;
constexpr int step = many_or_few(1, 4);        // 200 programs, or 50: every fourth shard
constexpr double max_refused_fraction = 0.15;  // the share of one shard's programs
constexpr double max_unstable_fraction = 0.1;

// The random styles, under the names that the fuzzer uses.
struct Kind {
  const char* name;
  Style style;
  ScheduleStyle schedules;
};
Kind pipelines() { return {"pipelines", Style::pipelines(), {}}; }
Kind chains() { return {"chains", Style::chains(), ScheduleStyle::windows()}; }

class Total {
 public:
  void add(uint64_t seed, const Kind& kind) {
    Choices choices(seed);
    const RandomProgram program = make_program(choices, kind.style);
    const ScheduleLog schedule = random_schedule(program, choices, kind.schedules);
    const std::string text = to_text(program, schedule);
    const Watch watch = seed % 4 == 2 ? Watch::Pages : Watch::Accesses;
    Judged judged = check_program(program, schedule, get_jit_target_from_environment(), watch);
    compared += judged.counts["values"];
    unstable += judged.counts["unstable"];
    refused += judged.judgement == Judgement::Refused;
    EXPECT_LE(judged.judgement, Judgement::Refused)
        << "seed " << seed << " is " << name_of(judged.judgement) << ": " << judged.detail << "\n"
        << text << "Shrink it: fuzz_pipelines --style " << kind.name << " --seed " << seed;
  }
  uint64_t compared = 0, unstable = 0;
  int refused = 0;
};

class RandomPrograms : public ::testing::TestWithParam<int> {};

TEST_P(RandomPrograms, MachineCodeAgreesWithTheInterpreter) {
  Total total;
  for (int i = 0; i < programs_per_shard; ++i) {
    const auto seed = first_seed + static_cast<uint64_t>(GetParam() * programs_per_shard + i);
    total.add(seed, pipelines());
    if (i % 2 == 0) total.add(seed, chains());
  }
  EXPECT_LE(total.refused, max_refused_fraction * programs_per_shard);
  EXPECT_GT(total.compared, 0u);
  EXPECT_LE(total.unstable, max_unstable_fraction * total.compared);
}

INSTANTIATE_TEST_SUITE_P(Shard, RandomPrograms, ::testing::Range(0, shards, step));

}  // namespace
}  // namespace retrograde::fuzz

// Random pipelines under Pipeline::auto_schedule for a GPU: schedules are legal and results are right on the simulated
// device. A program that is refused is also refused without a schedule.
#include <gtest/gtest.h>

#include "frontend/run/pipeline.h"
#include "ir/target.h"
#include "simt/simt_driver.h"
#include "support/program_counts.h"
#include "support/simulated_device.h"
#include "testing/check_program.h"

namespace retrograde::fuzz {
namespace {

constexpr uint64_t first_seed = 8000;
constexpr int orders = 4;
constexpr int programs_per_shard = 4;
constexpr int shards = many_or_few(150, 15);  // 600 programs, or 60

RandomProgram program_of(uint64_t seed) {
  Choices choices(seed);
  return make_program(choices, Style::pipelines());
}

class GpuAutoSchedules : public ::testing::TestWithParam<int> {};

TEST_P(GpuAutoSchedules, AreLegalAndRight) {
  retrograde_simt_options options;
  retrograde_simt_get_options(&options);
  options.order = GetParam() % orders;
  retrograde_simt_set_options(&options);
  const Target target = with_gpu();
  uint64_t compared = 0;
  int on_gpu = 0;
  for (int i = 0; i < programs_per_shard; ++i) {
    const uint64_t seed = first_seed + static_cast<uint64_t>(GetParam() * programs_per_shard + i);
    const RandomProgram program = program_of(seed);
    std::string source;
    Judged judged = check_with_schedule(
        program, [&] { source = Pipeline(program.outputs).auto_schedule(target).schedule_source; },
        target);
    compared += judged.counts["values"];
    on_gpu += source.find("gpu_") != std::string::npos;
    if (judged.judgement == Judgement::Right) continue;
    const Judged as_it_is = check_program(program_of(seed), {}, get_host_target());
    EXPECT_LE(judged.judgement, as_it_is.judgement)
        << "seed " << seed << " is " << name_of(judged.judgement) << ": " << judged.detail << "\n"
        << to_text(program) << "auto_schedule gave\n"
        << source;
  }
  EXPECT_GT(compared, 0u);
  EXPECT_GE(on_gpu, programs_per_shard - 1);
}

INSTANTIATE_TEST_SUITE_P(Shard, GpuAutoSchedules, ::testing::Range(0, shards));

}  // namespace
}  // namespace retrograde::fuzz

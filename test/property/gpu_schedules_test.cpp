// Tests random pipelines under random GPU schedules. Kernels on the simulated device must agree with the interpreter in
// every order of threads, without races. test/property/fuzz_gpu.cpp runs further seeds.
#include <gtest/gtest.h>

#include "ir/target.h"
#include "simt/simt_driver.h"
#include "support/simulated_device.h"
#include "testing/check_program.h"
#include "testing/random_gpu_schedule.h"

namespace retrograde::fuzz {
namespace {

constexpr uint64_t first_seed = 5000;
constexpr int programs_per_order = 40;
constexpr double max_refused_fraction = 0.1;

class GpuSchedules : public ::testing::TestWithParam<int> {};

TEST_P(GpuSchedules, KernelsAgreeWithTheInterpreter) {
  retrograde_simt_options options;
  retrograde_simt_get_options(&options);
  options.order = GetParam();
  retrograde_simt_set_options(&options);
  const Target target = with_gpu();
  uint64_t compared = 0;
  int refused = 0;
  GpuScheduleCounts used;
  for (int i = 0; i < programs_per_order; ++i) {
    const uint64_t seed = first_seed + static_cast<uint64_t>(GetParam() * programs_per_order + i);
    Choices choices(seed);
    const RandomProgram program = make_program(choices, Style::pipelines());
    Judged judged = check_with_schedule(
        program,
        [&] {
          for (const auto& [what, n] : schedule_on_gpu(program, choices)) used[what] += n;
        },
        target);
    compared += judged.counts["values"];
    refused += judged.judgement == Judgement::Refused;
    EXPECT_LE(judged.judgement, Judgement::Refused)
        << "seed " << seed << " is " << name_of(judged.judgement) << ": " << judged.detail << "\n"
        << to_text(program) << "Shrink it: fuzz_gpu --seed " << seed;
  }
  EXPECT_LE(refused, max_refused_fraction * programs_per_order);
  EXPECT_GT(compared, 0u);
  for (const char* what : {"kernels", "Funcs in blocks", "partial results", "atomic updates"})
    EXPECT_GE(used[what], 3u) << what;
}

INSTANTIATE_TEST_SUITE_P(Order, GpuSchedules, ::testing::Range(0, 4));

}  // namespace
}  // namespace retrograde::fuzz

// Programs with GPU schedules on the simulated device. They must give the CPU's results in every
// thread order, without races; streaming programs must request few sectors of memory. Any failing
// driver call must give an error, leak nothing, and leave the next run correct.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "simt/simt_driver.h"
#include "support/gpu_programs.h"
#include "support/program_counts.h"
#include "support/simulated_device.h"

namespace {

using namespace retrograde;

constexpr int invalid_value = 1, out_of_memory = 2;  // CUresult

void set(int order, bool profile) {
  retrograde_simt_options options;
  retrograde_simt_get_options(&options);
  options.order = order;
  options.profile = profile;
  retrograde_simt_set_options(&options);
}

// The two sides round differently: other orders of sums, other functions.
void expect_close(const Buffer<float>& got, const Buffer<float>& expected) {
  ASSERT_EQ(got.number_of_elements(), expected.number_of_elements());
  for (size_t i = 0; i < got.number_of_elements(); ++i) {
    const float wanted = expected.data()[i];
    ASSERT_NEAR(got.data()[i], wanted, 2e-5f * std::max(1.0f, std::abs(wanted))) << "element " << i;
  }
}

class GpuPrograms : public testing::TestWithParam<gpu_programs::Program> {
 protected:
  void TearDown() override { set(retrograde_simt_forward, false); }
  Buffer<float> on_cpu() const {
    return GetParam().build(false).realize(GetParam().sizes, get_host_target());
  }
};

TEST_P(GpuPrograms, GiveWhatTheCpuGives) {
  const Buffer<float> expected = on_cpu();
  Func f = GetParam().build(true);
  for (int order = retrograde_simt_forward; order <= retrograde_simt_warp_ahead; ++order) {
    set(order, false);
    const Buffer<float> got = f.realize(GetParam().sizes, with_gpu());
    expect_close(got, expected);
  }
}

class GpuStreams : public GpuPrograms {};

TEST_P(GpuStreams, AskForFewSectors) {
  Func f = GetParam().build(true);
  set(retrograde_simt_forward, true);
  retrograde_simt_reset_profile();
  f.realize(GetParam().sizes, with_gpu());
  retrograde_simt_profile profile = {};
  ASSERT_TRUE(retrograde_simt_get_profile(nullptr, &profile));
  EXPECT_GT(profile.ideal_sectors, 0);
  EXPECT_LE(static_cast<double>(profile.global_sectors),
            1.1 * static_cast<double>(profile.ideal_sectors))
      << profile.global_sectors << " sectors, " << profile.ideal_sectors << " had they been dense";
}

int64_t live_bytes() {
  retrograde_simt_live live;
  retrograde_simt_count_live(&live);
  return live.allocated_bytes;
}

TEST_P(GpuPrograms, SurviveEachFailureOfTheDriver) {
  Func f = GetParam().build(true);
  const Buffer<float> expected = f.realize(GetParam().sizes, with_gpu());
  // Releases memory kept for later runs, so that it does not count as a leak.
  const auto kept = [] {
    const auto* device = get_device_interface_for_device_api(DeviceAPI::CUDA);
    device->device_release(nullptr, device);
    return live_bytes();
  };
  const int64_t before = kept();
  int failures = 0;
  for (int i = 0;; ++i) {
    const char* function = retrograde_simt_function(i);
    if (!function) break;
    const int64_t first = retrograde_simt_call_count(function);
    f.realize(GetParam().sizes, with_gpu());
    const int64_t calls = retrograde_simt_call_count(function) - first;
    kept();
    for (int64_t nth = 1; nth <= calls; ++nth) {
      retrograde_simt_fail_call(function, nth, nth % 2 ? invalid_value : out_of_memory);
      try {
        const Buffer<float> got = f.realize(GetParam().sizes, with_gpu());
        expect_close(got, expected);  // optional requests may fail without an error
      } catch (const RuntimeError& error) {
        EXPECT_NE(std::string(error.what()).find(function), std::string::npos) << error.what();
        ++failures;
      }
      retrograde_simt_call_off();
      EXPECT_EQ(kept(), before) << "left behind when call " << nth << " of " << function
                                << " failed";
      const Buffer<float> after = f.realize(GetParam().sizes, with_gpu());
      expect_close(after, expected);
      kept();
    }
  }
  EXPECT_GT(failures, 5);
}

// Summing this many values serially in float is inaccurate, so the exact sum is the reference.
TEST(GpuReduction, OfManyValuesIsTheirSum) {
  constexpr int values = many_or_few(1 << 24, 1 << 20);
  double expected = 0;
  for (int i = 0; i < values; ++i) expected += static_cast<double>(gpu_programs::reduced_value(i));
  Func f = gpu_programs::reduction(values).build(true);
  for (int order = retrograde_simt_forward; order <= retrograde_simt_warp_ahead; ++order) {
    set(order, false);
    const Buffer<float> got = f.realize({1}, with_gpu());
    EXPECT_NEAR(static_cast<double>(got(0)), expected, 1e-5 * expected);
  }
  set(retrograde_simt_forward, false);
}

std::vector<gpu_programs::Program> streaming() {
  std::vector<gpu_programs::Program> programs = gpu_programs::all();
  std::erase_if(programs, [](const auto& program) { return !program.is_streaming; });
  return programs;
}

INSTANTIATE_TEST_SUITE_P(Programs, GpuStreams, testing::ValuesIn(streaming()),
                         [](const auto& program) { return program.param.name; });
INSTANTIATE_TEST_SUITE_P(Programs, GpuPrograms, testing::ValuesIn(gpu_programs::all()),
                         [](const auto& program) { return program.param.name; });

}  // namespace

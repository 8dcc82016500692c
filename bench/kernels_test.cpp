// Each kernel at a small size computes the same on both sides.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "pairs/options.h"
#include "pairs/pair.h"
#include "pairs/report.h"
#include "pairs/worker.h"

namespace bench {

namespace {

class Kernel : public testing::TestWithParam<std::string> {};

// Or, of a gradient, what differences say, where Halide's gradient does not.
TEST_P(Kernel, GivesWhatHalideGives) {
  const std::filesystem::path scratch =
      std::filesystem::path(testing::TempDir()) / ("kernel_" + GetParam());
  std::filesystem::create_directories(scratch);
  Pair pair({GetParam(), true, 2, is_gradient(GetParam())}, BENCH_PROGRAMS);
  pair.run();
  const PairResult result = pair.result(scratch);
  std::filesystem::remove_all(scratch);
  EXPECT_FALSE(is_wrong(result)) << table_row(result, {});
  EXPECT_GT(result.operations, 0);
}

INSTANTIATE_TEST_SUITE_P(Forward, Kernel, testing::ValuesIn(kernel_names()),
                         [](const auto& test) { return test.param; });

INSTANTIATE_TEST_SUITE_P(Gradient, Kernel, testing::ValuesIn(gradient_names()),
                         [](const auto& test) { return test.param; });

class GradientKernel : public testing::TestWithParam<std::string> {};

TEST_P(GradientKernel, HasTheSameBitsOnAnyThreads) {
  const auto scratch = std::filesystem::path(testing::TempDir()) / ("threads_" + GetParam());
  std::filesystem::create_directories(scratch);
  Worker worker(Side::Retrograde, {GetParam(), true, 5, true}, BENCH_PROGRAMS);
  EXPECT_TRUE(has_same_bits_on({1, 2, 3, 5, 5}, worker, scratch));
  std::filesystem::remove_all(scratch);
}

INSTANTIATE_TEST_SUITE_P(Gradient, GradientKernel, testing::ValuesIn(gradient_names()),
                         [](const auto& test) { return test.param; });

// Outputs of our worker, scheduled by hand or by the autoscheduler of that name.
std::vector<Values> outputs_of(const std::string& kernel, const std::string& schedule) {
  const auto scratch = std::filesystem::path(testing::TempDir()) / ("auto_" + kernel + schedule);
  std::filesystem::create_directories(scratch);
  WorkerCommand command{std::filesystem::path(BENCH_PROGRAMS) / "bench_kernels_retrograde",
                        {kernel, "small", "2"}};
  if (!schedule.empty()) command.arguments.push_back(schedule);
  Worker worker(Side::Retrograde, command, 2);
  worker.run();
  const std::vector<Values> outputs = worker.outputs(scratch);
  std::filesystem::remove_all(scratch);
  return outputs;
}

class AutoscheduledKernel : public testing::TestWithParam<std::string> {};

TEST_P(AutoscheduledKernel, GivesWhatItGivesByHand) {
  EXPECT_LE(max_relative_error(outputs_of(GetParam(), "Retrograde"), outputs_of(GetParam(), "")),
            1e-4);
}

INSTANTIATE_TEST_SUITE_P(Forward, AutoscheduledKernel, testing::ValuesIn(kernel_names()),
                         [](const auto& test) { return test.param; });

TEST(MaxRelativeError, IsRelativeToTheLargerOfElementAndScale) {
  // scale: sqrt((100 + 0) / 2)
  EXPECT_NEAR(max_relative_error({{false, {10, 0.5}}}, {{false, {10, 0}}}), 0.5 / std::sqrt(50.0),
              1e-12);
  EXPECT_NEAR(max_relative_error({{false, {11, 0}}}, {{false, {10, 0}}}), 0.1, 1e-12);
  EXPECT_EQ(max_relative_error({{false, {1, 2}}}, {{false, {1, 2}}}), 0);
}

TEST(MaxRelativeError, NoticesWhatIsNotANumberOrMissing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isinf(max_relative_error({{false, {nan}}}, {{false, {1}}})));
  EXPECT_TRUE(std::isinf(max_relative_error({{false, {1}}}, {{false, {nan}}})));
  EXPECT_EQ(max_relative_error({{false, {nan}}}, {{false, {nan}}}), 0);
  EXPECT_TRUE(std::isinf(max_relative_error({{false, {1}}}, {{false, {1, 2}}})));
  EXPECT_TRUE(std::isinf(max_relative_error({{false, {}}}, {{false, {}}})));
}

TEST(Worker, SaysThatAKernelIsUnknown) {
  try {
    Worker worker(Side::Retrograde, {"no_such_kernel", true, 1}, BENCH_PROGRAMS);
    FAIL();
  } catch (const WorkerError& error) {
    EXPECT_NE(std::string(error.what()).find("no_such_kernel"), std::string::npos);
  }
}

TEST(Timing, IsMedianLeastAndMiddleHalf) {
  const Timing timing = timing_of({5, 1, 3, 2, 4});
  EXPECT_EQ(timing.median, 3);
  EXPECT_EQ(timing.least, 1);
  EXPECT_EQ(timing.spread, 2);
}

}  // namespace

}  // namespace bench

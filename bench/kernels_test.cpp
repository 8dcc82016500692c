// Checks that each kernel gives the same results on both sides, at a small size.
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

class Kernel : public testing::TestWithParam<std::string> {
 protected:
  Kernel() { std::filesystem::create_directories(scratch_); }
  ~Kernel() override { std::filesystem::remove_all(scratch_); }

  // For a gradient that differs from Halide's, ours must agree with differences and Halide's must not.
  void expect_what_halide_gives(Pair& pair) const {
    pair.run();
    const PairResult result = pair.result(scratch_);
    EXPECT_FALSE(is_wrong(result)) << table_row(result, {});
    EXPECT_GT(result.operations, 0);
  }

  const std::filesystem::path scratch_ =
      std::filesystem::path(testing::TempDir()) / ("kernel_" + GetParam());
};

class ForwardKernel : public Kernel {};

TEST_P(ForwardKernel, GivesWhatHalideGivesByHandAndByTheAutoscheduler) {
  Pair pair({GetParam(), true, 2}, BENCH_PROGRAMS);
  expect_what_halide_gives(pair);
  const WorkerCommand command{std::filesystem::path(BENCH_PROGRAMS) / "bench_kernels_retrograde",
                              {GetParam(), "small", "2", "Retrograde"}};
  Worker scheduled(Side::Retrograde, command, 2);
  scheduled.run();
  EXPECT_LE(max_relative_error(scheduled.outputs(scratch_), pair.retrograde().outputs(scratch_)),
            1e-4)
      << "scheduled by the autoscheduler, against by hand";
}

INSTANTIATE_TEST_SUITE_P(Forward, ForwardKernel, testing::ValuesIn(kernel_names()),
                         [](const auto& test) { return test.param; });

class GradientKernel : public Kernel {};

TEST_P(GradientKernel, GivesWhatHalideGivesInTheSameBitsOnAnyThreads) {
  Pair pair({GetParam(), true, 2, true}, BENCH_PROGRAMS);
  expect_what_halide_gives(pair);
  // Uses more threads than Halide's schedulers handle well.
  Worker worker(Side::Retrograde, {GetParam(), true, 5, true}, BENCH_PROGRAMS);
  EXPECT_TRUE(has_same_bits_on({1, 2, 3, 5, 5}, worker, scratch_))
      << "the bits depend on how many threads there are";
}

INSTANTIATE_TEST_SUITE_P(Gradient, GradientKernel, testing::ValuesIn(gradient_names()),
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

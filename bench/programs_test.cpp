// Tests that programs at their smallest size give the same results on both sides, and that the text of their cases
// round-trips.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "programs/cases.h"
#include "programs/compare.h"

namespace programs {

namespace {

// For the running test only, because others run at the same time.
std::filesystem::path scratch() {
  std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
  std::replace(test.begin(), test.end(), '/', '_');
  const auto folder = std::filesystem::path(testing::TempDir()) / "programs" / test;
  std::filesystem::create_directories(folder);
  return folder;
}

class Smallest : public testing::TestWithParam<std::string> {};

// Only programs that both sides compile in about a second.
TEST_P(Smallest, GivesWhatHalideGives) {
  const Toolchains toolchains{{bench::Side::Retrograde, BENCH_PROGRAMS, scratch()},
                              {bench::Side::Halide, BENCH_PROGRAMS, scratch()}};
  const Limits limits{1, 1, 0, 2};
  const Result result =
      compare(GetParam(), toolchains, limits, BENCH_PROGRAMS "/bench_programs_worker", scratch(),
              [](const std::string&) {});
  EXPECT_FALSE(is_wrong(result)) << program_row(result);
}

INSTANTIATE_TEST_SUITE_P(Programs, Smallest,
                         testing::Values("blur_u16", "wavelet_forward", "resample_u8", "gemv",
                                         "conv_layer_x86", "harris", "rgb_gain",
                                         "gradient_recursive_filter"),
                         [](const auto& test) { return test.param; });

TEST(Compare, SaysThatAProgramIsUnknown) {
  const Toolchains toolchains{{bench::Side::Retrograde, BENCH_PROGRAMS, scratch()},
                              {bench::Side::Halide, BENCH_PROGRAMS, scratch()}};
  const Result result =
      compare("no_such_program", toolchains, {}, "", scratch(), [](const std::string&) {});
  EXPECT_NE(result.failure.find("no_such_program"), std::string::npos) << result.failure;
  EXPECT_TRUE(is_wrong(result));
}

TEST(Cases, SurviveTheirText) {
  Program program{"some", 0, 0.25, {{"small", 2, {}}, {"large", 0, {}}}};
  program.cases[0].arguments = {in<uint16_t>({5, 7, 3}, 0, 1000).interleaved(),
                                value<float>(0.125f), in<int8_t>({9}, -128, 127).noise(),
                                out<double>({4, 6}).from({-1, 2})};
  write_cases(scratch() / "some.cases", program);
  const Program again = read_cases(scratch() / "some.cases");
  ASSERT_EQ(again.cases.size(), 2u);
  EXPECT_EQ(again.name, "some");
  EXPECT_EQ(again.tolerance, 0.25);
  EXPECT_EQ(again.cases[0].threads, 2);
  const std::vector<Argument>& a = again.cases[0].arguments;
  ASSERT_EQ(a.size(), 4u);
  EXPECT_TRUE(a[0].is_interleaved && a[0].type.bits == 16 && a[0].type.code == 1);
  EXPECT_EQ(a[0].extents, (std::vector{5, 7, 3}));
  EXPECT_TRUE(a[1].role == Role::Scalar && a[1].low == 0.125);
  EXPECT_TRUE(a[2].is_noise && a[2].low == -128);
  EXPECT_EQ(a[3].mins, (std::vector{-1, 2}));
}

}  // namespace

}  // namespace programs

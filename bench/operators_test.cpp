// Tests each operator at a small size: its gradients in double agree with differences of its program, and its gradients
// in float, which the benchmark measures, agree with them and are bit-identical for any number of threads.
#include <gtest/gtest.h>

#include <filesystem>

#include "pairs/pair.h"

namespace bench {

namespace {

const std::vector<std::string> operator_names{
#define OPERATOR(name) #name,
#include "operators/list.def"
};

WorkerCommand worker(const char* program, const std::string& name) {
  return {std::filesystem::path(BENCH_PROGRAMS) / program, {name, "small", "5"}};
}

class Operator : public testing::TestWithParam<std::string> {};

TEST_P(Operator, HasTheGradientsOfItsProgram) {
  const std::filesystem::path scratch =
      std::filesystem::path(testing::TempDir()) / ("operator_" + GetParam());
  std::filesystem::create_directories(scratch);
  Worker exact(Side::Retrograde, worker("bench_operators_float64", GetParam()), 5);
  Worker measured(Side::Retrograde, worker("bench_operators_retrograde", GetParam()), 5);
  exact.run();
  measured.run();
  EXPECT_LT(max_relative_error(measured.outputs(scratch), exact.outputs(scratch)), 1e-4);
  EXPECT_LT(exact.slope_error(), 1e-5);
  EXPECT_GT(measured.operations, 0);
  EXPECT_TRUE(has_same_bits_on({1, 2, 3, 5, 5}, measured, scratch));
  std::filesystem::remove_all(scratch);
}

INSTANTIATE_TEST_SUITE_P(Small, Operator, testing::ValuesIn(operator_names),
                         [](const auto& test) { return test.param; });

}  // namespace

}  // namespace bench

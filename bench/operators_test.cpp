// The gradients of each operator at a small size are what differences of its program say.
#include <gtest/gtest.h>

#include <filesystem>

#include "pairs/pair.h"

namespace bench {

namespace {

const std::vector<std::string> operator_names{
#define OPERATOR(name) #name,
#include "operators/list.def"
};

class Operator : public testing::TestWithParam<std::string> {};

TEST_P(Operator, HasTheGradientsOfItsProgram) {
  const std::filesystem::path program =
      std::filesystem::path(BENCH_PROGRAMS) / "bench_operators_retrograde";
  Worker worker(Side::Retrograde, {program, {GetParam(), "small", "2"}}, 2);
  EXPECT_GT(worker.run(), 0);
  EXPECT_LT(worker.slope_error(), wrong_slope);
  EXPECT_GT(worker.operations, 0);
}

INSTANTIATE_TEST_SUITE_P(Small, Operator, testing::ValuesIn(operator_names),
                         [](const auto& test) { return test.param; });

}  // namespace

}  // namespace bench

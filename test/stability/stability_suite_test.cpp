// Runs every program of the stability suite on every input. The compiler's float32 gradient must be finite wherever the
// true one is, and its errors must be those that docs/stability.md states. problems.h and traced.h describe the oracle.
//
// This test also writes the page: run it with RETROGRADE_UPDATE_GOLDEN=1, and read the difference before you commit it.
// Its bounds are powers of ten, so that they hold on every machine. A bound that is far from the measured error fails
// like one that does not hold.
#include <gtest/gtest.h>

#include <cctype>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "stability/page.h"

namespace retrograde::stability {
namespace {

const std::string path = RETROGRADE_TEST_DIR "/../docs/stability.md";

std::string on_disk() {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

// For a = 1e-30, 1 - b * second is only the rounding error of a cancellation. The program divides it by a twice, beyond
// float32. The exact difference is small, not lost, so these cases do not count as outside.
const std::string rounding_noise = "2 x 2 system by elimination";

class Suite : public ::testing::TestWithParam<size_t> {};

TEST_P(Suite, GradientsAreFiniteAndErrorsAreThoseOfThePage) {
  const Family family = all_families()[GetParam()];
  const std::string page = on_disk();
  for (const Problem& problem : family.problems) {
    const Row row = measure(problem);
    for (const Cell& cell : row.cells) {
      if (problem.name == rounding_noise) continue;
      EXPECT_EQ(cell.lost, 0) << problem.name << " at " << cell.lost_at;
    }
    const std::string disagreement = disagreement_with(page, problem.name, row);
    EXPECT_EQ(disagreement, "") << problem.name << "; RETROGRADE_UPDATE_GOLDEN=1 writes " << path;
  }
}

std::string name_of(const ::testing::TestParamInfo<size_t>& info) {
  std::string result;
  const Family family = all_families()[info.param];
  for (char c : family.name) {
    if (std::isalpha(static_cast<unsigned char>(c))) result += c;
  }
  return result;
}
INSTANTIATE_TEST_SUITE_P(Families, Suite, ::testing::Range<size_t>(0, all_families().size()),
                         name_of);

TEST(StabilityPage, HasTheProgramsOfTheSuite) {
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) {
    std::ofstream(path) << render([](const Problem& p) { return measure(p); });
  }
  // Compares the pages without the measured numbers, which are the cells of a row after the program.
  EXPECT_EQ(without_figures(on_disk()),
            without_figures(render([](const Problem&) { return Row(); })));
}

}  // namespace
}  // namespace retrograde::stability

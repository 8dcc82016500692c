// Tests the cheap-gradient principle: a gradient takes at most 5 times the operations of its program, regardless of the
// number of inputs (Griewank and Walther, Evaluating Derivatives, 2nd edition, 4.6: 3 to 4 in theory).
//
// operation_count.h counts the operations, which has small tests of its own. The test covers every program of the suite
// and the large ones. It lists the exceptions, each with its reason, and checks that each one is still needed.
// RETROGRADE_UPDATE_GOLDEN=1 writes docs/gradient_costs.md.
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <map>
#include <sstream>

#include "gradient/programs_large.h"

namespace retrograde::gradient {
namespace {

constexpr double limit = 5, limit_of_exceptions = 12;

enum class Reason { Zeros, Stable, Steps, Again, InPlace, FewPoints };

const char* text_of(Reason reason) {
  switch (reason) {
    case Reason::Zeros:
      return "most elements of the input are never read; their gradient is set to 0";
    case Reason::Stable:
      return "the program is one function, whose stable partials take several operations";
    case Reason::Steps:
      return "the nonlinear parts of a step are recomputed, for the backward run and for the "
             "inputs";
    case Reason::Again:
      return "some values are recomputed, which is faster than loading them";
    case Reason::FewPoints:
      return "the grid has a few points in each direction: the gradient also visits its border, at "
             "every step";
    case Reason::InPlace:
      break;
  }
  return "every iteration reads values that others overwrite; they are recomputed";
}

const std::map<std::string, Reason> exceptions = {
    {"angle_of_a_vector", Reason::Stable},
    {"length_of_a_vector", Reason::Stable},
    {"long_short_term_memory", Reason::Steps},
    {"recursive_filter_of_second_order_along_both_axes", Reason::InPlace},
    {"streaming_softmax", Reason::Steps},
    {"backward_steps", Reason::FewPoints},
    {"diffusion_whose_steps_are_all_read", Reason::FewPoints},
    {"jacobi_iterations_in_one_domain", Reason::FewPoints},
    {"odd_and_even_columns_in_place", Reason::FewPoints},
    {"red_black_products_from_an_image", Reason::FewPoints},
    {"red_black_relaxation", Reason::FewPoints},
    {"steps_as_the_innermost_variable", Reason::FewPoints},
    {"wave_from_one_source", Reason::FewPoints},
    {"diagonal_of_a_matrix_of_funcs", Reason::Zeros},
    {"diagonal_read_twice", Reason::Zeros},
    {"diagonals", Reason::Zeros},
    {"in_place_normalisation", Reason::InPlace},
    {"log_sum_exp_as_an_operator", Reason::Steps},
    {"streaming_log_sum_exp_in_a_tuple", Reason::Steps},
    {"tree_of_products", Reason::Again},
};

// The domain is empty, so there is nothing to compare with.
const std::string without_elements = "shift_of_no_elements";

struct Cost {
  std::string name;
  double primal = 0, gradient = 0;
  double ratio() const { return gradient / primal; }
};

Cost cost_of(const std::string& name, const Program& program) {
  AdjointOptions options;
  if (program.store_overwritten) options.overwritten = Overwritten::Store;
  const Derivative d = propagate_adjoints(program.loss, options);
  const GradientOperations operations = d.operations();
  return {name, operations.primal.operations().value().value_or(0),
          operations.gradient.operations().value().value_or(1e9)};
}

const std::vector<Cost>& costs() {
  static const std::vector<Cost> all = [] {
    std::vector<Cost> result;
    for (const NamedProgram& p : programs()) {
      if (p.name != without_elements) result.push_back(cost_of(p.name, p.build()));
    }
    for (const LargeProgram& p : large_programs())
      result.push_back(cost_of(p.name, p.build(test_side)));
    return result;
  }();
  return all;
}

TEST(GradientCost, IsAtMostFiveTimesThatOfTheProgram) {
  for (const Cost& cost : costs()) {
    SCOPED_TRACE(cost.name);
    ASSERT_GT(cost.primal, 0);
    const auto listed = exceptions.find(cost.name);
    if (listed == exceptions.end()) {
      EXPECT_LE(cost.ratio(), limit);
      continue;
    }
    EXPECT_GT(cost.ratio(), limit) << "it is no exception any more";
    EXPECT_LE(cost.ratio(), limit_of_exceptions);
  }
}

double median() {
  std::vector<double> ratios;
  for (const Cost& cost : costs()) ratios.push_back(cost.ratio());
  std::nth_element(ratios.begin(), ratios.begin() + std::ptrdiff_t(ratios.size() / 2),
                   ratios.end());
  return ratios[ratios.size() / 2];
}

std::string page() {
  std::ostringstream out;
  out << std::fixed << std::setprecision(1);
  out << R"(# Operation counts of gradients

The ratio of a program is the number of operations of its gradient with respect to all inputs, divided by the number
of operations of the program. `Derivative::operations()` counts both under the default schedules: loads and stores,
additions, products and function calls. The ratio is at most )"
      << limit << " for all but " << exceptions.size() << " of " << costs().size()
      << " programs; the median is " << median() << R"(.

`test/gradient/cost_test.cpp` computes the ratios and writes this page. `tools/bench gradients` measures run times.

## Exceptions

Each exception is a constant factor, independent of the size.

| program | ratio | reason |
|---|---|---|
)";
  for (const Cost& cost : costs()) {
    const auto listed = exceptions.find(cost.name);
    if (listed == exceptions.end()) continue;
    out << "| `" << cost.name << "` | " << cost.ratio() << " | " << text_of(listed->second)
        << " |\n";
  }
  return out.str();
}

TEST(GradientCost, ThePageSaysSo) {
  const std::string path = RETROGRADE_TEST_DIR "/../docs/gradient_costs.md";
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) std::ofstream(path) << page();
  std::ifstream file(path);
  const std::string on_disk((std::istreambuf_iterator<char>(file)), {});
  EXPECT_EQ(on_disk, page()) << "RETROGRADE_UPDATE_GOLDEN=1 writes " << path;
}

}  // namespace
}  // namespace retrograde::gradient

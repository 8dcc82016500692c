// Every quasi-affine access becomes a gather, whose left-hand sides are pure variables or fixed indices, with the right
// values. The table also shows how Halide 14 differentiates the same line. The expected values come from evaluating the
// pipeline on unit vectors, without any differentiation.
#include <gtest/gtest.h>

#include <iostream>

#include "gradient/access_table/side.h"

namespace access_table {
namespace {

std::string verdict(const Outcome& outcome, const std::vector<float>& expected) {
  if (!outcome.error.empty()) return "no gradient";
  std::string shape = outcome.is_gather() ? "gather" : "scatter";
  long iterations = 0;
  bool parametric = false;
  for (const UpdateShape& u : outcome.updates)
    iterations += u.iterations, parametric |= u.iterations < 0;
  shape += parametric ? ", n steps" : ", " + std::to_string(iterations) + " steps";
  return shape + (outcome.gradient == expected ? "" : ", WRONG");
}

std::string padded(std::string text, size_t width) {
  text.resize(std::max(width, text.size() + 1), ' ');
  return text;
}

TEST(AccessTable, QuasiAffineAccessesBecomeGathersWithPureDimensions) {
  std::vector<Description> all = descriptions();
  std::cout << padded("access", 46) << padded("Retrograde", 26) << "Halide 14\n";
  size_t quasi_affine = 0;
  for (size_t i = 0; i < all.size(); ++i) {
    SCOPED_TRACE(all[i].name);
    std::vector<float> expected = gradient_by_columns(i);
    Outcome ours = differentiate_in_retrograde(i), peer = differentiate_in_halide(i);
    std::cout << padded(all[i].name, 46) << padded(verdict(ours, expected), 26)
              << verdict(peer, expected) << "\n";
    EXPECT_EQ(ours.error, "");
    EXPECT_EQ(ours.gradient, expected);
    bool is_gather = all[i].nature != Nature::DataDependent;
    EXPECT_EQ(ours.is_gather(), is_gather);
    quasi_affine += all[i].nature == Nature::QuasiAffine;
  }
  EXPECT_GE(quasi_affine, 30u);
}

}  // namespace
}  // namespace access_table

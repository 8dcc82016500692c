// Random programs of smooth operations, quasi-affine accesses and updates: the gradient against
// central differences along a random direction, in double. The seed of a failure is printed and
// replays it.
#include "gradient/random_program.h"

namespace retrograde::gradient {
namespace {

double directional_difference(RandomProgram& p, const std::vector<float>& direction) {
  auto at = [&](float step) {
    size_t i = 0;
    p.image.get()->for_each_value([&](float& v) { v += step * direction[i++]; });
    double result = evaluate_scalar(p.loss);
    i = 0;
    p.image.get()->for_each_value([&](float& v) { v -= step * direction[i++]; });
    return result;
  };
  auto slope = [&](float h) { return (at(h) - at(-h)) / (2.0 * h); };
  return (4 * slope(1.0f / 512) - slope(1.0f / 256)) / 3;
}

TEST(RandomGradients, AgreeWithCentralDifferences) {
  int refused = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomProgram p(seed);
    std::vector<float> direction;
    std::mt19937 random(seed);
    p.image.get()->for_each_value(
        [&](float&) { direction.push_back(static_cast<float>(random() % 3) - 1.0f); });
    Func gradient;
    try {
      gradient = propagate_adjoints(p.loss, {.overwritten = Overwritten::Store})(p.image);
    } catch (const Unsupported&) {
      ++refused;
      continue;
    }
    oracle::Array found = evaluate(gradient, {{0, 0}, {size, size}});
    double reverse = 0, scale = 0;
    for (size_t i = 0; i < found.values.size(); ++i) {
      reverse += found.values[i].scalar.as_double() * direction[i];
      scale += std::abs(found.values[i].scalar.as_double());
    }
    double expected = directional_difference(p, direction);
    EXPECT_NEAR(reverse, expected, 1e-5 * (scale + 1));
  }
  EXPECT_LT(refused, 6);
}

}  // namespace
}  // namespace retrograde::gradient

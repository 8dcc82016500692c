// No schedule that the compiler chose reads more than the program and its gradient need.
#include <gtest/gtest.h>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"
#include "frontend/language/inline_reductions.h"
#include "gradient/odd_sizes/program.h"

namespace retrograde::gradient {
namespace {

#ifdef RETROGRADE_MANY_PROGRAMS
constexpr uint64_t first_program = 0, programs = 200;
#else
constexpr uint64_t first_program = 0, programs = 8;
#endif

TEST(OddSizes, ValuesAndGradientsRunAndAreRight) {
  for (uint64_t seed = first_program; seed < first_program + programs; ++seed) {
    Choices choices(seed);
    const OddProgram program = make_odd_program(choices);
    EXPECT_EQ(check_odd_program(program, 20'000'000), "") << seed << ": " << program.pieces;
  }
}

// The gain's gradient is summed in lanes of 16, of which 30 leave two over, by private parts that
// compute the place of the smallest again.
TEST(OddSizes, PrivatePartsComputeAgainNoMoreThanTheirDomainHas) {
  constexpr int n = 30, taps = 5;
  Buffer<float> image(n + taps - 1, n);
  image.fill(0.5f);
  Param<float> gain("gain");
  gain.set(0.75f);
  Var x("x"), y("y");
  RDom r(0, taps), all(0, n, 0, n);
  Func f("f"), loss("loss");
  f(x, y) = argmin(r, image(x + r, y))[1] * gain;
  f.compute_root();
  loss() = 0.0f;
  loss() += f(all.x, all.y) * f(all.x, all.y);
  Buffer<float> by_gain = propagate_adjoints(loss)(gain).realize();
  EXPECT_NEAR(by_gain(), 2 * 0.75f * 0.25f * n * n, 1e-3);
}

// Places are clamped into domains; an empty one has none at its end.
TEST(OddSizes, AReductionOfRunTimeExtentZeroHasAGradientOfZero) {
  Buffer<float> image(24);
  image.fill(0.5f);
  Param<int> count("count");
  Param<float> gain("gain");
  gain.set(0.75f);
  Var x("x");
  RDom r(0, count);
  Func f("f"), of_image("of_image"), of_func("of_func"), of_sum("of_sum");
  f(x) = image(x) * gain;
  f.compute_root();
  of_image() = gain;
  of_image() += image(r) * image(r) * gain;
  of_func() = gain;
  of_func() += f(r) * f(r);
  of_sum() = gain + sum(r, image(r) * gain);
  for (const Func& loss : {of_image, of_func, of_sum}) {
    const Derivative d = propagate_adjoints(loss);
    Func by_image = d(image), by_gain = d(gain);
    for (int n : {0, 3}) {
      count.set(n);
      Buffer<float> slopes = by_image.realize({24}), slope = by_gain.realize();
      EXPECT_EQ(slopes(0) != 0, n > 0) << loss.name() << " of " << n;
      EXPECT_EQ(slopes(3), 0);
      EXPECT_EQ(slope() != 1, n > 0) << loss.name() << " of " << n;
    }
  }
}

}  // namespace
}  // namespace retrograde::gradient

// Updates whose reduction domain counts steps, as the autoscheduler runs them, forward and in gradients: results against
// the interpreter and on several threads.
#include <gtest/gtest.h>

#include "driver/schedule.h"
#include "frontend/run/pipeline.h"
#include "gradient/gradient_check.h"
#include "graph/names.h"
#include "support/errors.h"

namespace retrograde {
namespace {

using gradient::random_image;

void expect_results(const Func& f, const std::vector<int>& sizes) {
  const oracle::Region region{std::vector<int>(sizes.size()), sizes};
  const oracle::Array expected = oracle::Interpreter({.rounding = oracle::Rounding::Contraction})
                                     .realize(f.function(), region)
                                     .front();
  Func g = f;
  Pipeline(g).auto_schedule(get_host_target());
  const Buffer<float> first = gradient::run_on_threads(g, region, 1, false);
  const auto comparison =
      oracle::compare(expected, *const_cast<Buffer<float>&>(first).raw_buffer(), 4);
  EXPECT_TRUE(comparison.agrees()) << comparison.first_mismatch << "\n" << g.loop_nest();
  for (const int threads : {2, 5}) {
    for (const bool backward : {false, true})
      EXPECT_TRUE(
          gradient::same_bits(first, gradient::run_on_threads(g, region, threads, backward)));
  }
}

struct StepLoops : ::testing::Test {
  // Steps of diffusion over an image of n by n.
  void diffuse(int n, int steps) {
    image = random_image({n, n}, -1, 1, 3);
    u(x, y, t) = image(x, y);
    RDom r(1, n - 2, 1, n - 2, 1, steps, "r");
    u(r.x, r.y, r.z) = 0.25f * (u(r.x - 1, r.y, r.z - 1) + u(r.x + 1, r.y, r.z - 1) +
                                u(r.x, r.y - 1, r.z - 1) + u(r.x, r.y + 1, r.z - 1));
  }
  // Steps of a wave whose squared speed is another image.
  void wave(int n, int steps) {
    image = random_image({n, n}, 0.125, 0.25, 3);
    u(x, y, t) = select(x == n / 2 && y == n / 3 && t < 2, 1.0f, 0.0f);
    RDom r(1, n - 2, 1, n - 2, 2, steps, "r");
    const Expr here = u(r.x, r.y, r.z - 1);
    u(r.x, r.y, r.z) =
        2 * here - u(r.x, r.y, r.z - 2) +
        image(r.x, r.y) * (u(r.x - 1, r.y, r.z - 1) + u(r.x + 1, r.y, r.z - 1) +
                           u(r.x, r.y - 1, r.z - 1) + u(r.x, r.y + 1, r.z - 1) - 4 * here);
  }

  Var x{"x"}, y{"y"}, t{"t"};
  Func u{"u"}, last{"last"};
  Buffer<float> image;
};

TEST_F(StepLoops, AreEqualToTheInterpreter) {
  diffuse(37, 4);
  expect_results(u, {37, 37, 5});
}

TEST_F(StepLoops, ThatAreParallelAreEqualToTheInterpreter) {
  Param<int> steps("steps");  // whose value is not known to the scheduler
  steps.set(3);
  Param<int> n("n");
  n.set(37);
  u(x, y, t) = cast<float>(x * y % 7);
  RDom r(1, n - 2, 1, n - 2, 1, steps, "r");
  u(r.x, r.y, r.z) = 0.5f * u(r.x - 1, r.y, r.z - 1) + 0.25f * u(r.x, r.y + 1, r.z - 1);
  expect_results(u, {37, 37, 4});
}

TEST_F(StepLoops, TwoStepsBack) {
  wave(37, 4);
  expect_results(u, {37, 37, 6});
}

TEST_F(StepLoops, NoneOrOneOfThem) {
  for (const int steps : {0, 1}) {
    u = Func("u");
    diffuse(20, steps);
    expect_results(u, {20, 20, 2});
  }
}

TEST_F(StepLoops, NoPointsOrOneOfThem) {
  for (const int points : {0, 1}) {
    Param<int> n("n");
    n.set(points);
    u = Func("u");
    u(x, y, t) = cast<float>(x + t);
    RDom r(1, n, 1, n, 1, 3, "r");
    u(r.x, r.y, r.z) = u(r.x - 1, r.y, r.z - 1) * 2.0f + u(r.x, r.y + 1, r.z - 1);
    expect_results(u, {5, 5, 5});
  }
}

// The time is the first variable, so its loop is declared as the innermost one.
TEST_F(StepLoops, AreMovedOutwardIfThatChangesNothing) {
  u(x, t) = cast<float>(x);
  RDom r(1, 5, 1, 40, "r");
  u(r.y, r.x) = u(r.y - 1, r.x - 1) + u(r.y, r.x - 1);
  expect_results(u, {41, 6});
}

// x + 1 is written after x has read it.
TEST_F(StepLoops, StayInsideIfTheirOrderMatters) {
  u(x, t) = cast<float>(x);
  RDom r(1, 5, 1, 40, "r");
  u(r.y, r.x) = u(r.y + 1, r.x - 1) + u(r.y, r.x - 1);
  expect_results(u, {42, 6});
}

TEST_F(StepLoops, PointsOfAStepThatReadEachOtherStaySerial) {
  u(x, y, t) = cast<float>(x - y);
  RDom r(1, 40, 1, 40, 1, 5, "r");
  u(r.x, r.y, r.z) = 0.25f * (u(r.x - 1, r.y, r.z) + u(r.x, r.y - 1, r.z) +
                              u(r.x + 1, r.y, r.z - 1) + u(r.x, r.y + 1, r.z - 1));
  expect_results(u, {42, 42, 6});
}

TEST_F(StepLoops, InPlaceInTwoColours) {
  Func p("p");
  p(x, y) = cast<float>(x * 3 % 5 + y);
  RDom r(1, 40, 1, 40, 0, 2, 0, 3, "r");
  r.where((r.x + r.y) % 2 == r.z);
  p(r.x, r.y) = 0.25f * (p(r.x - 1, r.y) + p(r.x + 1, r.y) + p(r.x, r.y - 1) + p(r.x, r.y + 1));
  expect_results(p, {42, 42});
}

TEST_F(StepLoops, InPlaceInTwoColoursByChoice) {
  Func p("p");
  p(x, y) = cast<float>(x * 3 % 5 + y);
  RDom r(1, 40, 1, 40, 0, 5, "r");
  const Expr next = p(r.x - 1, r.y) + p(r.x + 1, r.y) + p(r.x, r.y - 1) + p(r.x, r.y + 1);
  p(r.x, r.y) = select((r.x + r.y + r.z) % 2 == 0, 0.25f * next, p(r.x, r.y));
  expect_results(p, {42, 42});
}

// The size is unknown, so rows are parallel.
TEST_F(StepLoops, InPlaceOfOneColourByChoiceAreParallel) {
  Func p("p");
  Param<int> n("n");
  n.set(40);
  p(x, y) = cast<float>(x * 3 % 5 + y);
  RDom r(1, n, 1, n, "r");
  const Expr next = p(r.x - 1, r.y) + p(r.x + 1, r.y) + p(r.x, r.y - 1) + p(r.x, r.y + 1);
  p(r.x, r.y) = select((r.x + r.y) % 2 != 1, 0.25f * next, p(r.x, r.y));
  expect_results(p, {42, 42});
}

// Rows that never meet are the outermost tasks, and the steps run inside of them.
TEST_F(StepLoops, AreInsideOfWhatIsApart) {
  u(x, y, t) = cast<float>(x * y % 5);
  RDom r(1, 1000, 0, 64, 1, 20, "r");
  u(r.x, r.y, r.z) = u(r.x - 1, r.y, r.z - 1) + 0.5f * u(r.x + 1, r.y, r.z - 1);
  expect_results(u, {1002, 64, 21});
}

TEST_F(StepLoops, OfOneLongRowAreChunks) {
  u(x, t) = cast<float>(x % 5);
  RDom r(1, 300000, 1, 3, "r");
  u(r.x, r.y) = u(r.x - 1, r.y - 1) + 0.5f * u(r.x + 1, r.y - 1);
  Func few("few");
  few(x) = u(x * 100, 3);
  expect_results(few, {3001});
}

// The sum of a point runs inside of it.
TEST_F(StepLoops, OfAMatrix) {
  Buffer<float> m = random_image({24, 24}, -1, 1, 5);
  u(x, t) = select(t == 0, cast<float>(x % 5), 0.0f);
  RDom r(0, 24, 0, 24, 0, 4, "r");
  u(r.y, r.z + 1) += 0.25f * m(r.x, r.y) * u(r.x, r.z);
  expect_results(u, {24, 5});
}

TEST_F(StepLoops, OfTheInteriorOfAnImage) {
  u(x, y, t) = 0.0f;
  RDom r(1, 500, 1, 500, "r");
  u(r.x, r.y, 0) = cast<float>(r.x * r.y) + u(r.x, r.y, 0) * sin(u(r.x, r.y, 0));
  expect_results(u, {502, 502, 1});
}

// ---- directives of a user ----

TEST_F(StepLoops, AUserMayRunThemInParallelToo) {
  diffuse(37, 4);
  RVar a(u.rvars(0)[0]), b(u.rvars(0)[1]);
  u.compute_root();
  u.update(0).parallel(b).vectorize(a, 8);
  const Buffer<float> found = u.realize({37, 37, 5});
  Func plain = u;
  u = Func("u");
  diffuse(37, 4);
  EXPECT_TRUE(gradient::same_bits(found, u.realize({37, 37, 5})));
}

TEST_F(StepLoops, LoopsStayInsideOfTheStepsThatMakeThemIndependent) {
  u(x, t) = cast<float>(x);
  RDom r(1, 40, 1, 5, "r");
  u(r.x, r.y) = u(r.x - 1, r.y - 1);
  u.update(0).parallel(r.x);
  expect_error<CompileError>({"reorder", "is parallel", "same element", "Keep"},
                             [&] { u.update(0).reorder(r.y, r.x); });
}

TEST_F(StepLoops, TheOutermostLoopIsNotIndependent) {
  diffuse(20, 4);
  RVar time(u.rvars(0)[2]);
  expect_error<CompileError>({"parallelize", "same element"}, [&] { u.update(0).parallel(time); });
}

TEST_F(StepLoops, ThreadsOfAKernelDoNotWaitForEachOther) {
  diffuse(20, 4);
  RVar a(u.rvars(0)[0]);
  expect_error<CompileError>({"GPU", "same element"}, [&] { u.update(0).gpu_threads(a); });
}

// ---- gradients ----

struct GradientsOfStepLoops : StepLoops {
  void take_last(int step) { last(x, y) = u(x, y, step); }
};

TEST_F(GradientsOfStepLoops, OfDiffusion) {
  diffuse(20, 3);
  take_last(3);
  gradient::expect_gradient(gradient::weighted_sum(last, {20, 20}), image);
}

TEST_F(GradientsOfStepLoops, OfAWave) {
  wave(11, 4);
  take_last(5);
  gradient::expect_gradient(gradient::weighted_sum(last, {11, 11}), image);
}

TEST_F(GradientsOfStepLoops, InPlaceInTwoColoursByChoice) {
  image = random_image({11, 9}, -1, 1, 3);
  Func p("p");
  p(x, y) = image(x, y);
  RDom r(1, 9, 1, 7, 0, 3, "r");
  const Expr next = p(r.x - 1, r.y) + p(r.x + 1, r.y) + p(r.x, r.y - 1) + p(r.x, r.y + 1);
  p(r.x, r.y) = select((r.x + r.y + r.z) % 2 == 0, 0.25f * next, p(r.x, r.y));
  const Func loss = gradient::weighted_sum(p, {11, 9});
  gradient::expect_gradient(loss, image);
}

TEST_F(GradientsOfStepLoops, OfNoStep) {
  diffuse(9, 0);
  take_last(0);
  gradient::expect_gradient(gradient::weighted_sum(last, {9, 9}), image);
}

}  // namespace
}  // namespace retrograde

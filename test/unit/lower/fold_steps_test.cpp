// Loops over time whose storage holds only the steps that are still read: results against the interpreter, and the
// memory that a run takes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/run/pipeline.h"
#include "gradient/gradient_check.h"
#include "support/measured_threads.h"
#include "testing/interpreter.h"

namespace retrograde {
namespace {

using gradient::random_image;

struct FoldSteps : ::testing::Test {
  static constexpr int n = 48;
  static constexpr int64_t slice = int64_t{4} * n * n;

  Var x{"x"}, y{"y"}, t{"t"};
  Func u{"u"}, last{"last"};
  Buffer<float> image = random_image({n, n}, -1, 1, 3), other = random_image({n, n}, -1, 1, 4);
  RDom r;

  // A stencil over the step before.
  Expr around(const Expr& time) const {
    return 0.25f * (u(r.x - 1, r.y, time) + u(r.x + 1, r.y, time) + u(r.x, r.y - 1, time) +
                    u(r.x, r.y + 1, time));
  }
  void interior(const Expr& steps) { r = RDom(1, n - 2, 1, n - 2, 0, steps, "r"); }

  // The result is that of the interpreter, and the most memory at once is that of so many slices of u.
  void expect_slices(double slices) {
    u.compute_root();
    const oracle::Region region{{0, 0}, {n, n}};
    const oracle::Array expected = oracle::Interpreter({.rounding = oracle::Rounding::Contraction})
                                       .realize(last.function(), region)
                                       .front();
    Buffer<float> found(region.extents);
    MeasuredThreads measured(2);
    last.realize(&measured, found);
    const auto comparison = oracle::compare(expected, *found.raw_buffer(), 4);
    EXPECT_TRUE(comparison.agrees()) << comparison.first_mismatch;
    EXPECT_NEAR(static_cast<double>(measured.peak_bytes()) / slice, slices, 0.1);
  }
};

TEST_F(FoldSteps, KeepsTwoOfAStencil) {
  interior(9);
  u(x, y, t) = image(x, y);
  u(r.x, r.y, r.z + 1) = around(r.z);
  last(x, y) = u(x, y, 9);
  expect_slices(2);
}

TEST_F(FoldSteps, InParallelAndVectors) {
  interior(9);
  u(x, y, t) = image(x, y);
  u(r.x, r.y, r.z + 1) = around(r.z);
  last(x, y) = u(x, y, 9);
  u.parallel(t).vectorize(x, 8);
  u.update(0).parallel(RVar(u.rvars(0)[1])).vectorize(RVar(u.rvars(0)[0]), 8);
  expect_slices(2);
}

TEST_F(FoldSteps, StartsWithASelectedImage) {
  interior(9);
  u(x, y, t) = select(t == 0, image(x, y), 0.5f);
  u(r.x, r.y, r.z + 1) = around(r.z);
  last(x, y) = u(x, y, 9);
  expect_slices(2);
}

TEST_F(FoldSteps, StartsWithUpdates) {
  interior(9);
  u(x, y, t) = 0.0f;
  u(x, y, 0) = image(x, y);
  u(x, y, 1) = other(x, y) - u(x, y, 1);
  u(r.x, r.y, r.z + 2) = around(r.z + 1) - 0.5f * u(r.x, r.y, r.z);
  last(x, y) = u(x, y, 10) - u(x, y, 9);
  expect_slices(3);
}

TEST_F(FoldSteps, KeepsWhatThreeStepsBackNeed) {
  interior(9);
  u(x, y, t) = image(x, y);
  u(r.x, r.y, r.z) = around(r.z - 1) + u(r.x, r.y, r.z - 2) - 0.25f * u(r.x, r.y, r.z - 3);
  last(x, y) = u(x, y, 8);
  expect_slices(4);
}

TEST_F(FoldSteps, KeepsTheLastStepsThatAreRead) {
  interior(9);
  u(x, y, t) = image(x, y);
  u(r.x, r.y, r.z + 1) = around(r.z);
  last(x, y) = u(x, y, 9) + u(x, y, 8) + u(x, y, 6);
  expect_slices(4);
}

TEST_F(FoldSteps, KeepsAllThatAreRead) {
  interior(9);
  u(x, y, t) = image(x, y);
  u(r.x, r.y, r.z + 1) = around(r.z);
  last(x, y) = u(x, y, x % 10);
  expect_slices(10);
}

TEST_F(FoldSteps, KeepsTheFirstOneIfItIsRead) {
  interior(30);
  u(x, y, t) = image(x, y);
  u(r.x, r.y, r.z + 1) = around(r.z);
  last(x, y) = u(x, y, 30) - u(x, y, 0);
  expect_slices(31);
}

// The border of each step is that of its own time.
TEST_F(FoldSteps, StartOfEachStepDependsOnTheTime) {
  interior(9);
  u(x, y, t) = image(x, y) + cast<float>(t);
  u(r.x, r.y, r.z + 1) = around(r.z);
  last(x, y) = u(x, y, 9);
  expect_slices(2);
}

TEST_F(FoldSteps, StepsThatStoreOtherElementsEachTime) {
  interior(9);
  r.where(r.x > 3 * r.z && r.y % 2 == 0);
  u(x, y, t) = image(x, y);
  u(r.x, r.y, r.z + 1) = around(r.z) + 1.0f;
  last(x, y) = u(x, y, 9);
  expect_slices(2);
}

TEST_F(FoldSteps, StepsThatDataChoose) {
  interior(9);
  r.where(other(r.x, r.y) > 0);
  u(x, y, t) = image(x, y);
  u(r.x, r.y, r.z + 1) = around(r.z) + 1.0f;
  last(x, y) = u(x, y, 9);
  expect_slices(2);
}

TEST_F(FoldSteps, StepsThatAddToTheirStart) {
  interior(9);
  u(x, y, t) = image(x, y);
  u(x, y, 4) += other(x, y);
  u(r.x, r.y, r.z + 1) += around(r.z);
  last(x, y) = u(x, y, 9);
  expect_slices(2);
}

TEST_F(FoldSteps, BackwardInTime) {
  interior(9);
  u(x, y, t) = 0.0f;
  u(x, y, 9) += image(x, y);
  u(r.x, r.y, 8 - r.z) += around(9 - r.z);
  last(x, y) = u(x, y, 0);
  expect_slices(2);
}

// The start of a step may be an update for all times.
TEST_F(FoldSteps, SourcesAreAddedForAllTimes) {
  interior(9);
  RDom when(0, 10, "when");
  u(x, y, t) = 0.0f;
  u(x, 3, when) += cast<float>(when + x);
  u(r.x, r.y, r.z + 1) += around(r.z);
  last(x, y) = u(x, y, 9);
  expect_slices(2);
}

TEST_F(FoldSteps, ReadsAheadSeeTheStart) {
  interior(9);
  u(x, y, t) = image(x, y) * cast<float>(t);
  u(r.x, r.y, r.z + 1) = around(r.z) + u(r.x, r.y, r.z + 2);
  last(x, y) = u(x, y, 9);
  expect_slices(11);
}

TEST_F(FoldSteps, AnyNumberOfSteps) {
  for (const int steps : {0, 1, 2, 3, 7, -2}) {
    Param<int> count("count");
    count.set(steps);
    u = Func("u");
    last = Func("last");
    interior(count);
    u(x, y, t) = image(x, y) + cast<float>(t);
    u(r.x, r.y, r.z + 1) = around(r.z) - u(r.x, r.y, r.z - 1);
    last(x, y) = u(x, y, count) - 2 * u(x, y, count - 1);
    expect_slices(3);
  }
}

TEST_F(FoldSteps, OfATuple) {
  interior(9);
  u(x, y, t) = Tuple(image(x, y), other(x, y));
  const auto value = [&](const Expr& i, const Expr& j, int k) -> Expr { return u(i, j, r.z)[k]; };
  u(r.x, r.y, r.z + 1) = Tuple(0.5f * (value(r.x - 1, r.y, 0) + value(r.x, r.y + 1, 1)),
                               0.5f * (value(r.x, r.y, 1) - value(r.x + 1, r.y, 0)));
  last(x, y) = u(x, y, 9)[0] - u(x, y, 9)[1];
  expect_slices(4);
}

// The steps of each image of a batch.
TEST_F(FoldSteps, InALoopOfTheirConsumer) {
  interior(9);
  Func each("each");
  Var b("b");
  u(x, y, t) = image(x, y);
  u(r.x, r.y, r.z + 1) = around(r.z);
  each(x, y, b) = u(x, y, 9) + cast<float>(b);
  u.compute_at(each, b);
  const Buffer<float> found = each.realize({n, n, 3});
  u.compute_root();
  last(x, y) = u(x, y, 9);
  const Buffer<float> one = last.realize({n, n});
  for (int k = 0; k < 3; ++k) EXPECT_EQ(found(5, 7, k), one(5, 7) + static_cast<float>(k));
}

// Steps of the producer of a step, which is computed in it.
TEST_F(FoldSteps, WithAProducerInsideOfAStep) {
  interior(9);
  Func twice("twice");
  Var k("k");
  twice(x, k) = image(x, k % n) * 2.0f;
  u(x, y, t) = image(x, y);
  u(r.x, r.y, r.z + 1) = around(r.z) + twice(r.x, r.y + r.z);
  twice.compute_at(u, u.rvars(0)[2]);
  last(x, y) = u(x, y, 9);
  expect_slices(2);
}

// ---- gradients: sums over all steps are added up in the steps ----

struct FoldedGradients : ::testing::Test {
  static constexpr int n = 320, count = 24;
  static constexpr double megabyte = int64_t{4} * n * n;  // of a slice

  Var x{"x"}, y{"y"}, t{"t"};
  Buffer<float> start = random_image({n, n}, -1, 1, 3), speed = random_image({n, n}, 0, 0.25, 4);

  using Read = std::function<Expr(const Expr& x, const Expr& y)>;
  static Expr flow(const Read& u, const Expr& x, const Expr& y) {
    return u(x - 1, y) + u(x + 1, y) + u(x, y - 1) + u(x, y + 1) - 4 * u(x, y);
  }

  // The same steps as a loop and as Funcs.
  Func loop() {
    Func u("u"), last("last");
    RDom r(1, n - 2, 1, n - 2, 0, count, "r");
    u(x, y, t) = start(x, y);
    const Read now = [&](const Expr& i, const Expr& j) -> Expr { return u(i, j, r.z); };
    u(r.x, r.y, r.z + 1) = now(r.x, r.y) + speed(r.x, r.y) * flow(now, r.x, r.y);
    last(x, y) = u(x, y, count);
    return last;
  }
  Func steps() {
    Func u("u");
    u(x, y) = start(x, y);
    const Expr inside = x > 0 && x < n - 1 && y > 0 && y < n - 1;
    for (int i = 0; i < count; ++i) {
      Func next("next");
      const Read now = [&](const Expr& i, const Expr& j) -> Expr {
        return u(clamp(i, 0, n - 1), clamp(j, 0, n - 1));
      };
      next(x, y) = select(inside, u(x, y) + speed(x, y) * flow(now, x, y), u(x, y));
      u = next;
    }
    return u;
  }

  // Gradients by both images, and the most memory at once in slices.
  std::vector<Buffer<float>> gradients(const Func& last, double& slices) {
    const Func loss = gradient::weighted_sum(last, {n, n});
    const Derivative d = propagate_adjoints(loss);
    std::vector<Func> outputs{Func("by_start"), Func("by_speed")};
    const std::vector<Func> sums{d(start), d(speed)};
    for (int i = 0; i < 2; ++i) {
      Func sum = sums[i];
      outputs[i](x, y) = sum(x, y);
      sum.compute_root();
    }
    std::vector<Buffer<float>> results;
    for (Func& f : outputs) {
      for (int k = 0; k < 2; ++k) f.output_buffer().dim(k).set_bounds(0, n);
      results.emplace_back(n, n);
    }
    MeasuredThreads measured(2);
    Pipeline(outputs).realize(&measured, {results[0], results[1]});
    slices = static_cast<double>(measured.peak_bytes()) / megabyte;
    return results;
  }
};

TEST_F(FoldedGradients, AreThoseOfStepsAsFuncs) {
  double of_loop = 0, of_steps = 0;
  const auto found = gradients(loop(), of_loop), expected = gradients(steps(), of_steps);
  for (int i = 0; i < 2; ++i) {
    float most = 0, error = 0;
    expected[i].get()->for_each_element([&](int column, int row) {
      most = std::max(most, std::abs(expected[i](column, row)));
      error = std::max(error, std::abs(expected[i](column, row) - found[i](column, row)));
    });
    EXPECT_GT(most, 0.1f);
    EXPECT_LT(error, 1e-5f * most) << "gradient " << i;
  }
  // All steps of u, which the gradient by the speed reads; two of its adjoint; the sums, and what they add.
  EXPECT_LT(of_loop, count + 1 + 6.1);
}

}  // namespace
}  // namespace retrograde

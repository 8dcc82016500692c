// Tests the parts of deconvolution: point-spread functions and simulated problems. A stage's energy, its gradient and
// its minimum are compared with plain C++. Also tests what is learned, and by which gradient.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/images.h"
#include "deconvolution/checks.h"
#include "deconvolution/cleaning.h"
#include "deconvolution/deconvolver.h"
#include "deconvolution/psf.h"
#include "deconvolution/reference.h"
#include "deconvolution/training.h"
#include "scenes.h"
#include "support/temporary_folder.h"

namespace {

using namespace deconvolution;
using deconvolution_test::scene;

double sum_of(const Psf& psf) {
  return std::accumulate(psf.samples.begin(), psf.samples.end(), 0.0);
}

TEST(Psf, DiscsCoverWhatTheirRadiusSays) {
  for (const double radius : {0.4, 1.5, 3.0, 5.0}) {
    const Psf disc = defocus_disc(radius);
    EXPECT_NEAR(sum_of(disc), 1, 1e-6);
    EXPECT_EQ(disc.size % 2, 1);
    EXPECT_GE(disc.size / 2 + 0.5, radius);
    const double area = std::acos(-1.0) * radius * radius;
    if (radius <= 1) continue;
    EXPECT_NEAR(1 / disc.at(disc.size / 2, disc.size / 2), area, 0.03 * area);
  }
  EXPECT_EQ(defocus_disc(0.4).size, 1);
}

TEST(Psf, PathsAreCentredAndTheirSeedsDecide) {
  const Psf path = motion_path(19, 4), again = motion_path(19, 4), other = motion_path(19, 5);
  EXPECT_EQ(path.samples, again.samples);
  EXPECT_NE(path.samples, other.samples);
  EXPECT_NEAR(sum_of(path), 1, 1e-6);
  double x_mean = 0, y_mean = 0;
  for (int y = 0; y < 19; ++y) {
    for (int x = 0; x < 19; ++x) {
      EXPECT_GE(path.at(x, y), 0);
      x_mean += (x - 9) * path.at(x, y);
      y_mean += (y - 9) * path.at(x, y);
    }
  }
  EXPECT_NEAR(x_mean, 0, 0.3);
  EXPECT_NEAR(y_mean, 0, 0.3);
}

TEST(Psf, OfAnImageIsItsBrightnessAboutItsBox) {
  const TemporaryFolder folder;
  apps::Image image{9, 7, 8, std::vector<float>(3 * 63, 0.0f)};
  const auto set = [&](int x, int y, float value) {
    for (size_t c = 0; c < 3; ++c) image.pixels[3 * static_cast<size_t>(y * 9 + x) + c] = value;
  };
  set(4, 2, 1.0f);
  set(6, 4, 1.0f);
  apps::write_image(folder.path() / "psf.png", image);
  const Psf psf = psf_of(folder.path() / "psf.png");
  EXPECT_EQ(psf.size, 3);
  EXPECT_FLOAT_EQ(psf.at(0, 0), 0.5f);
  EXPECT_FLOAT_EQ(psf.at(2, 2), 0.5f);
}

TEST(Psf, MirroringAndEnlargingKeepTheSum) {
  const Psf path = motion_path(9, 2), large = enlarged(path, 15);
  EXPECT_EQ(large.at(3 + 4, 3 + 5), path.at(4, 5));
  EXPECT_NEAR(sum_of(large), 1, 1e-6);
}

TEST(Simulation, BlursWithoutABorder) {
  Simulated one;
  Random random(1);
  const Plane luma = luma_of(scene(24, 20));
  Psf shift{"shift", 3, std::vector<float>(9, 0.0f)};
  shift.samples[2] = 1;  // (2, 0): one pixel to the right and one up
  one.add(luma, shift, 0, random);
  EXPECT_EQ(one.problem.extent.width, 22);
  EXPECT_EQ(one.problem.extent.height, 18);
  // k * x at (1, 1) of the photograph is x at that point minus (1, -1).
  EXPECT_FLOAT_EQ(one.problem.blurred[0], luma.at(0, 2));
  EXPECT_FLOAT_EQ(one.truth[0], luma.at(1, 1));
}

// A problem of two images, each with its own point-spread function and noise.
Simulated small_problem(int width, int height, int psf) {
  Simulated problem;
  Random random(7);
  const int full_width = width + psf - 1, full_height = height + psf - 1;
  problem.add(luma_of(scene(full_width, full_height)), enlarged(defocus_disc(1.4), psf), 0.01,
              random);
  problem.add(luma_of(scene(full_width, full_height, 2)), motion_path(psf, 3), 0.02, random);
  return problem;
}

Weights shaken(Weights weights) {
  Random random(3);
  for (float& value : weights.values) value += static_cast<float>(0.1 * (random.uniform() - 0.5));
  return weights;
}

class StageOf : public testing::TestWithParam<Shape> {
 protected:
  Weights weights() const {
    return GetParam().bumps == 0 ? original() : shaken(learning_start(GetParam(), 2));
  }
};

INSTANTIATE_TEST_SUITE_P(Shapes, StageOf,
                         testing::Values(Shape{5, 3, 0}, Shape{4, 5, 3}, Shape{7, 3, 2}),
                         [](const auto& info) {
                           return "Filters" + std::to_string(info.param.filters);
                         });

TEST_P(StageOf, EnergyAndItsGradientAreThoseOfPlainCode) {
  const Simulated problem = small_problem(13, 11, 5);
  const Weights numbers = weights();
  const Extent e = problem.problem.extent;
  const auto before = padded<double>(problem.problem);
  auto image = before;
  Random random(9);
  for (double& value : image) value += 0.1 * random.normal();
  const Reference reference(numbers.shape, problem.problem, numbers.of(1));

  Stage stage(numbers.shape, e, lang::Float(64));
  bind_problem<double>(stage, problem.problem);
  const std::vector<double> of_stage(numbers.of(1).begin(), numbers.of(1).end());
  bind_numbers<double>(stage, std::span<const double>(of_stage));
  const std::vector<int> sizes{e.full_width(), e.full_height(), e.count};
  stage.image.set(filled<double>(sizes, std::span<const double>(image)));
  stage.before.set(filled<double>(sizes, std::span<const double>(before)));

  const lang::Buffer<double> cleaned = stage.cleaned.realize(sizes);
  const auto cleaned_by_hand = reference.cleaned(before);
  EXPECT_LT(
      apps::relative_error(std::vector<double>(cleaned.begin(), cleaned.end()), cleaned_by_hand),
      1e-12);
  const lang::Buffer<double> energy = stage.energy.realize();
  const double by_hand = reference.energy(image, before);
  EXPECT_NEAR(energy(), by_hand, 1e-12 * by_hand);
  const auto adjoints = lang::propagate_adjoints(stage.energy);
  const lang::Buffer<double> gradient = adjoints(stage.image).realize(sizes);
  EXPECT_LT(apps::relative_error(std::vector<double>(gradient.begin(), gradient.end()),
                                 reference.gradient(image, before)),
            1e-12);
}

TEST_P(StageOf, ConjugateGradientsEndWhereThoseOfPlainCodeDo) {
  const Simulated problem = small_problem(11, 10, 3);
  const Weights numbers = weights();
  const auto before = padded<double>(problem.problem);
  const auto by_hand = Reference(numbers.shape, problem.problem, numbers.of(1)).minimum(before);
  Solver<double> solver(numbers.shape, problem.problem.extent, 2);
  solver.set(problem.problem);
  const std::vector<double> of_stage(numbers.of(1).begin(), numbers.of(1).end());
  solver.set(std::span<const double>(of_stage));
  const auto image = solver.solve(before, {.iterations = 2000, .tolerance = 1e-13});
  EXPECT_LT(apps::relative_error(image, by_hand), 1e-6);
  EXPECT_LT(solver.energy(image, before), solver.energy(before, before));
}

TEST(Solver, IterationsEndAtTheToleranceOrWhereNothingIsLeft) {
  const Simulated problem = small_problem(20, 20, 3);
  Solver<float> solver(original().shape, problem.problem.extent, 2);
  const Weights weights = original();
  solver.set(problem.problem);
  solver.set(weights.of(0));
  const auto before = padded<float>(problem.problem);
  solver.solve(before, {.iterations = 500, .tolerance = 1e-2});
  const int few = solver.iterations();
  EXPECT_LE(solver.reduction(), 1e-2);
  solver.solve(before, {.iterations = 500, .tolerance = 1e-4});
  EXPECT_GT(solver.iterations(), few);
  const std::vector<float> nothing(before.size(), 0.0f);
  EXPECT_EQ(solver.solve_linear(nothing, {}), nothing);
  EXPECT_EQ(solver.iterations(), 0);
}

TEST(Solver, ResultsAreTheSameBitsForEveryNumberOfThreads) {
  const Simulated problem = small_problem(40, 30, 5);
  Deconvolver one({"original", original()}, problem.problem.extent, 1);
  Deconvolver two({"original", original()}, problem.problem.extent, 2);
  EXPECT_EQ(one.run(problem.problem), two.run(problem.problem));
}

TEST(Deconvolver, TheOriginalMethodSharpens) {
  Simulated problem;
  Random random(2);
  problem.add(luma_of(scene(110, 100)), enlarged(defocus_disc(3), 9), 0.01, random);
  problem.add(luma_of(scene(110, 100, 1)), motion_path(9, 1), 0.01, random);
  Deconvolver method({"original", original()}, problem.problem.extent, 2);
  const auto before = each_psnr_db(problem.problem.blurred, problem);
  const auto after = each_psnr_db(method.run(problem.problem), problem);
  for (size_t k = 0; k < 2; ++k) EXPECT_GT(after[k], before[k] + 2) << k;
  ASSERT_EQ(method.stages().size(), 2u);
  const auto first = each_psnr_db(method.stages().front(), problem);
  for (size_t k = 0; k < 2; ++k) EXPECT_GT(after[k], first[k]) << k;
}

TEST(Deconvolver, EndsWhereItsWatchSaysSo) {
  const Simulated problem = small_problem(24, 20, 5);
  Deconvolver method({"original", original()}, problem.problem.extent, 2);
  const auto none = method.run(problem.problem, [](int, const auto&) { return false; });
  EXPECT_EQ(none, problem.problem.blurred);
  EXPECT_TRUE(method.stopped());
  int calls = 0;
  std::vector<float> seen;
  const auto few = method.run(problem.problem, [&](int iterations, const auto& images) {
    EXPECT_EQ(iterations, calls);
    ++calls;
    seen.assign(images.begin(), images.end());
    return iterations < 3;
  });
  EXPECT_EQ(calls, 4);
  EXPECT_EQ(few, cropped(seen, problem.problem.extent));
  EXPECT_NE(few, none);
  EXPECT_EQ(method.stages().size(), 1u);
  EXPECT_TRUE(method.stopped());
  method.run(problem.problem);
  EXPECT_EQ(method.stages().size(), 2u);
  EXPECT_FALSE(method.stopped());
}

TEST(Deconvolver, WhatWasLearnedIsBetterThanTheOriginal) {
  Simulated problem;
  Random random(2);
  problem.add(luma_of(scene(110, 100)), enlarged(defocus_disc(3), 9), 0.01, random);
  problem.add(luma_of(scene(110, 100, 1)), motion_path(9, 1), 0.01, random);
  std::vector<double> mean;
  for (const Method& method : {Method{"original", original()},
                               {"learned", read_weights(DECONVOLUTION_WEIGHTS "/learned.json")}}) {
    Deconvolver deconvolver(method, problem.problem.extent, 2);
    const auto db = each_psnr_db(deconvolver.run(problem.problem), problem);
    mean.push_back((db[0] + db[1]) / 2);
  }
  EXPECT_GT(mean[1], mean[0] + 0.5);
}

TEST(Learning, GradientsAreWithinTheirLimits) {
  const auto rows = loss_gradients({scene(60, 60), scene(50, 70, 1)}, 1, 2);
  EXPECT_EQ(rows.size(), all_arrays.size());
  for (const apps::GradientRow& row : rows) {
    EXPECT_LE(row.in_double, apps::gradient_limit_double) << row.input;
    EXPECT_LE(row.in_float, apps::gradient_limit_float) << row.input;
  }
}

TEST(Learning, StagesAreLearnedByThemselvesAndThenTogether) {
  EXPECT_EQ(steps_apart(1000, 4), 62);
  EXPECT_EQ(learned_at(0, 25, 4).first, 0);
  EXPECT_EQ(learned_at(24, 25, 4).last, 0);
  EXPECT_EQ(learned_at(99, 25, 4).first, 3);
  EXPECT_EQ(learned_at(100, 25, 4).first, 0);
  EXPECT_EQ(learned_at(100, 25, 4).last, 3);
}

Trainer::Options few_steps(std::vector<std::string> groups = group_names) {
  apps::CommonOptions common;
  common.steps = 30;
  common.threads = 2;
  common.optimize = std::move(groups);
  return {.common = common, .from_weights = true, .batch = {.side = 24, .pieces = 4, .psf = 5}};
}

TEST(Learning, LossesFallAndOnlyWhatIsNamedMoves) {
  const std::vector<demosaic::Photograph> photographs{scene(80, 80), scene(80, 80, 1)};
  const Weights start = learning_start({.filters = 6, .size = 3, .bumps = 4}, 2);
  Trainer trainer(start, photographs, few_steps({"weights", "shrinkage"}));
  double first = 0, last = 0;
  for (int k = 0; k < 30; ++k) {
    const double loss = trainer.step();
    (k < 10 ? first : last) += k < 10 ? loss / 10 : loss / 20;
  }
  EXPECT_LT(last, first);
  EXPECT_EQ(trainer.adam().refused(), 0);
  Weights now = trainer.weights(), then = start;
  for (int stage = 0; stage < 2; ++stage) {
    for (const Array array : all_arrays) {
      const auto a = now.of(stage, array), b = then.of(stage, array);
      const bool same = std::equal(a.begin(), a.end(), b.begin());
      EXPECT_EQ(same, array == Array::Filters || array == Array::Smoothing) << name_of(array);
    }
  }
}

TEST(Learning, GoesOnAsIfItHadNotStopped) {
  const std::vector<demosaic::Photograph> photographs{scene(80, 80), scene(80, 80, 1)};
  const Weights start = learning_start({.filters = 5, .size = 3, .bumps = 2}, 2);
  Trainer whole(start, photographs, few_steps()), half(start, photographs, few_steps()),
      rest(start, photographs, few_steps());
  for (int k = 0; k < 6; ++k) whole.step();
  for (int k = 0; k < 3; ++k) half.step();
  apps::State state{.program = "deconvolution", .step = 3};
  half.save(state);
  rest.restore(state);
  for (int k = 0; k < 3; ++k) rest.step();
  EXPECT_EQ(rest.weights().values, whole.weights().values);
}

TEST(Weights, FilesGiveBackWhatTheyGot) {
  const TemporaryFolder folder;
  const Weights weights = shaken(learning_start({.filters = 9, .size = 5, .bumps = 3}, 3));
  write_weights(folder.path() / "w.json", weights, "a test");
  const Weights again = read_weights(folder.path() / "w.json");
  EXPECT_EQ(again.shape, weights.shape);
  EXPECT_EQ(again.stages, 3);
  for (size_t k = 0; k < weights.values.size(); ++k)
    EXPECT_NEAR(again.values[k], weights.values[k], 1e-5 * std::abs(weights.values[k]) + 1e-9);
}

}  // namespace

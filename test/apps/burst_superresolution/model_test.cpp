// Tests the parts of burst_superresolution: homographies, simulated bursts, noise, registration, the average. The
// objective and its gradient are compared with plain C++.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "burst_superresolution/average.h"
#include "burst_superresolution/bicubic.h"
#include "burst_superresolution/checks.h"
#include "burst_superresolution/evaluator.h"
#include "burst_superresolution/fit.h"
#include "burst_superresolution/noise.h"
#include "burst_superresolution/prepare.h"
#include "burst_superresolution/quality.h"
#include "burst_superresolution/reference.h"
#include "burst_superresolution/registration.h"
#include "burst_superresolution/simulation.h"
#include "common/images.h"
#include "scenes.h"
#include "support/temporary_folder.h"

namespace {

using namespace burst;
using burst_test::scene;

constexpr FrameSize frame_size{30, 22};

Homography some_homography(unsigned seed, double strength) {
  std::mt19937 random(seed);
  Homography h{};
  for (double& value : h) value = strength * (static_cast<double>(random() % 2001) / 1000 - 1);
  return h;
}

TEST(Homography, ZerosAreTheIdentityExactly) {
  for (const double x : {0.0, 0.1, 29.0}) {
    const Place place = place_of({}, frame_size, x, 21 - x / 3);
    EXPECT_EQ(place.x, x);
    EXPECT_EQ(place.y, 21 - x / 3);
  }
}

TEST(Homography, IsItsMatrix) {
  const Homography h = some_homography(1, 0.1);
  const Matrix m = matrix_of(h, frame_size);
  for (int y = 0; y < frame_size.height; y += 7) {
    for (int x = 0; x < frame_size.width; x += 7) {
      const double w = m[6] * x + m[7] * y + m[8];
      const Place place = place_of(h, frame_size, x, y);
      EXPECT_NEAR(place.x, (m[0] * x + m[1] * y + m[2]) / w, 1e-11);
      EXPECT_NEAR(place.y, (m[3] * x + m[4] * y + m[5]) / w, 1e-11);
    }
  }
  const Homography again = homography_of(m, frame_size);
  for (size_t k = 0; k < h.size(); ++k) EXPECT_NEAR(again[k], h[k], 1e-13);
}

TEST(Homography, InverseLeadsBack) {
  const Homography h = some_homography(2, 0.1), back = inverse(h, frame_size);
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {29.0, 0.0}, {13.0, 21.0}}) {
    const Place there = place_of(h, frame_size, x, y);
    const Place here = place_of(back, frame_size, there.x, there.y);
    EXPECT_NEAR(here.x, x, 1e-11);
    EXPECT_NEAR(here.y, y, 1e-11);
  }
}

TEST(Homography, ErrorIsADistanceInPixels) {
  Homography truth = some_homography(3, 0.02), found = truth;
  EXPECT_EQ(motion_error(found, truth, frame_size).worst, 0);
  truth = {}, found = {};
  found[2] = 3 / frame_size.scale();
  found[5] = 4 / frame_size.scale();
  EXPECT_NEAR(motion_error(found, truth, frame_size).mean, 5, 1e-12);
  EXPECT_NEAR(motion_error(found, truth, frame_size).worst, 5, 1e-12);
  const std::vector<Homography> both{found, found}, truths{truth, truth};
  EXPECT_NEAR(motion_error(both, truths, frame_size).mean, 5, 1e-12);  // the first does not count
}

TEST(Homography, ShakenCamerasDoNotMirrorOrZoomFar) {
  EXPECT_TRUE(is_small_motion({}, frame_size));
  EXPECT_TRUE(is_small_motion(some_homography(4, 0.05), frame_size));
  EXPECT_FALSE(is_small_motion({-2, 0, 0, 0, 0, 0, 0, 0}, frame_size));       // mirrored
  EXPECT_FALSE(is_small_motion({1, 0, 0, 0, 1, 0, 0, 0}, frame_size));        // four times as large
  EXPECT_FALSE(is_small_motion({-0.5, 0, 0, 0, -0.5, 0, 0, 0}, frame_size));  // a fourth
  EXPECT_FALSE(is_small_motion({0, 0, 0, 0, 0, 0, 0.9, 0}, frame_size));      // tilted
  EXPECT_FALSE(is_small_motion({0, 0, 0, 0, 0, 0, std::nan(""), 0}, frame_size));
}

// Keys' interpolation is exact for polynomials of degree two (his section IV), except near the borders.
TEST(Bicubic, ReproducesParabolas) {
  constexpr int width = 12, height = 10;
  const auto value = [](double x, double y) {
    return 0.3 + 0.1 * x - 0.02 * y + 0.015 * x * x - 0.01 * x * y + 0.02 * y * y;
  };
  std::vector<float> plane;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) plane.push_back(static_cast<float>(value(x, y)));
  }
  for (const auto& [x, y] : {std::pair{3.0, 4.0}, {5.25, 3.75}, {9.9, 1.1}})
    EXPECT_NEAR(bicubic(plane, width, height, x, y), value(x, y), 1e-6);
  EXPECT_EQ(bicubic(plane, width, height, -3, -3), plane.front());
}

TEST(Simulation, TheFirstFrameIsTheTruthsMosaic) {
  const Burst burst = simulate(scene(120, 100), {.frames = 3, .shake = 4, .noise = 0});
  ASSERT_TRUE(burst.truth);
  EXPECT_EQ(burst.truth->homographies[0], Homography{});
  const auto frame = burst.frame(0);
  for (int y = 0; y < burst.size.height; ++y) {
    for (int x = 0; x < burst.size.width; ++x) {
      const size_t at = static_cast<size_t>(y * burst.size.width + x);
      const auto c = static_cast<size_t>(demosaic::colour_at(x, y));
      ASSERT_NEAR(frame[at], burst.truth->planes[c * burst.size.pixels() + at], 1e-6);
    }
  }
}

TEST(Simulation, EveryFrameSeesAllThatCounts) {
  const Burst burst =
      simulate(scene(140, 110), {.frames = 9, .shake = 5, .rotation = 3, .noise = 0});
  const int border = burst.truth->border, right = burst.size.width - 1 - border,
            bottom = burst.size.height - 1 - border;
  ASSERT_GT(border, 5);
  ASSERT_GT(right, border);
  for (const Homography& h : burst.truth->homographies) {
    EXPECT_TRUE(is_small_motion(h, burst.size));
    const Homography to_frame = inverse(h, burst.size);
    for (const auto& [x, y] :
         {std::pair{border, border}, {right, border}, {border, bottom}, {right, bottom}}) {
      const Place at = place_of(to_frame, burst.size, x, y);
      EXPECT_GE(at.x, 0);
      EXPECT_GE(at.y, 0);
      EXPECT_LE(at.x, burst.size.width - 1);
      EXPECT_LE(at.y, burst.size.height - 1);
    }
  }
}

TEST(Simulation, IsThatOfItsSeed) {
  const auto photograph = scene(100, 90);
  const Burst one = simulate(photograph, {.frames = 2, .seed = 5});
  EXPECT_EQ(one.samples, simulate(photograph, {.frames = 2, .seed = 5}).samples);
  EXPECT_NE(one.samples, simulate(photograph, {.frames = 2, .seed = 6}).samples);
}

// If a sensor does not begin with red, the frame begins at its first red sample.
TEST(Frames, BeginWithRed) {
  const TemporaryFolder folder;
  const auto picture = scene(61, 51);
  apps::Image mosaic{61, 51, 16, {}, 1};
  for (int y = 0; y < 51; ++y) {
    for (int x = 0; x < 61; ++x)
      mosaic.pixels.push_back(picture.at(x, y, demosaic::colour_at(x + 1, y + 1)));
  }
  for (const char* name : {"b.png", "a.png"}) apps::write_image(folder.path() / name, mosaic);
  const Burst burst = read_burst(folder.path(), "BGGR");
  ASSERT_EQ(burst.names, (std::vector<std::string>{"a.png", "b.png"}));
  ASSERT_EQ(burst.size.width, 60);
  ASSERT_EQ(burst.size.height, 50);
  for (int y = 0; y < 50; ++y) {
    for (int x = 0; x < 60; ++x) {
      EXPECT_NEAR(burst.frame(1)[static_cast<size_t>(60 * y + x)],
                  picture.at(x + 1, y + 1, demosaic::colour_at(x, y)), 1e-4);
    }
  }
}

TEST(Noise, IsFoundWhereThePictureIsPlain) {
  auto photograph = scene(200, 140);
  for (size_t n = 0; n < photograph.planes.size(); ++n) {
    const auto x = static_cast<float>(n % 200);
    if (x < 90) photograph.planes[n] = 0.3f + 0.002f * x;
  }
  for (const double noise : {0.005, 0.02, 0.06}) {
    const Burst burst = simulate(photograph, {.frames = 2, .shake = 2, .noise = noise});
    EXPECT_NEAR(estimate_noise(burst), noise, 0.15 * noise) << noise;
  }
  Burst black;
  black.size = {32, 32};
  black.names = {"black"};
  black.samples.assign(32 * 32, 0.0f);
  EXPECT_EQ(estimate_noise(black), 0);
}

// A gray ramp that rises by 0.1 from each pixel to the next along x.
std::vector<float> gray_ramp(const FrameSize& size) {
  std::vector<float> planes(3 * size.pixels());
  for (size_t n = 0; n < planes.size(); ++n)
    planes[n] = 0.1f * static_cast<float>(n % static_cast<size_t>(size.width));
  return planes;
}

// The true picture explains everything but the noise, and does not fit any of the noise. The estimate corrects for that
// fit, so the test undoes the correction.
TEST(Noise, IsWhatAPictureLeavesUnexplained) {
  for (const double noise : {0.01, 0.03}) {
    const Burst burst =
        simulate(scene(140, 120),
                 {.frames = 6, .shake = 0, .rotation = 0, .zoom = 0, .tilt = 0, .noise = noise});
    const std::vector<float> x = joined(burst.truth->planes, burst.truth->homographies);
    EXPECT_NEAR(estimate_noise(burst, x) * std::sqrt(0.5), noise, 0.04 * noise);
  }
}

TEST(Noise, DifferencesAreThoseOfNeighbours) {
  const FrameSize size{4, 3};
  const auto ramp = gray_ramp(size);
  EXPECT_NEAR(mean_difference(ramp, size, {0, 1, 0}), 0.05, 1e-7);  // 0.1 along x, 0 along y
  const auto opponent = axes_of(Colours::Opponent);
  EXPECT_NEAR(mean_difference(ramp, size, opponent[0]), 0.05 * std::sqrt(3.0), 1e-7);
  EXPECT_NEAR(mean_difference(ramp, size, opponent[1]), 0, 1e-7);
  EXPECT_NEAR(mean_difference(ramp, size, opponent[2]), 0, 1e-7);
}

TEST(Noise, ColoursAreAtRightAngles) {
  for (const Colours colours : {Colours::Rgb, Colours::Opponent}) {
    const auto axes = axes_of(colours);
    for (size_t a = 0; a < 3; ++a) {
      for (size_t b = 0; b < 3; ++b) {
        double product = 0;
        for (size_t c = 0; c < 3; ++c) product += axes[a][c] * axes[b][c];
        EXPECT_NEAR(product, a == b ? 1 : 0, 1e-15);
      }
    }
  }
}

TEST(Noise, AsksForSmoothness) {
  const FrameSize size{8, 6};
  const auto ramp = gray_ramp(size);
  const auto weight = [&](double noise, std::optional<double> given) {
    return smoothness_for(noise, ramp, size, Colours::Rgb, given).at(2).weight;
  };
  EXPECT_NEAR(weight(0.02, {}), 0.016, 1e-8);  // 2 0.02^2 / 0.05
  EXPECT_NEAR(weight(0.04, {}), 0.064, 1e-8);
  EXPECT_EQ(weight(0, {}), 1e-3);
  EXPECT_EQ(weight(0.02, 0.5), 0.5);
  EXPECT_TRUE(smoothness_for(0.02, ramp, size, Colours::Rgb, 0.0).empty());
  const auto opponent = smoothness_for(0.02, ramp, size, Colours::Opponent, {});
  EXPECT_TRUE(std::isfinite(opponent[1].weight));  // although all differences are 0
  EXPECT_GT(opponent[1].weight, opponent[0].weight);
  const auto given = smoothness_for(0.02, ramp, size, Colours::Opponent, 0.5);
  EXPECT_NEAR(given[1].weight / given[0].weight, opponent[1].weight / opponent[0].weight, 1e-6);
}

TEST(Registration, FindsWhereAFrameLies) {
  const Burst burst =
      simulate(scene(260, 220), {.frames = 3, .shake = 6, .rotation = 2, .noise = 0.01});
  Burst copy = burst;
  const Prepared prepared = prepare(copy, Colours::Rgb, {}, 2);
  ASSERT_EQ(copy.frames(), 3);
  const MotionError error =
      motion_error(prepared.homographies, burst.truth->homographies, burst.size);
  const MotionError still =
      motion_error(std::vector<Homography>(3), burst.truth->homographies, burst.size);
  EXPECT_GT(still.mean, 2);
  EXPECT_LT(error.mean, 0.5);
}

TEST(Registration, FindsNothingInBlackAndInOtherPictures) {
  const FrameSize size{96, 80};
  const std::vector<float> black(3 * size.pixels(), 0.0f);
  EXPECT_FALSE(Registration(black, size).motion_of(black));
  const auto picture = scene(96, 80, 1), other = scene(96, 80, 9);
  const Registration registration(picture.planes, size);
  EXPECT_TRUE(registration.motion_of(picture.planes));
  EXPECT_FALSE(registration.motion_of(black));
}

TEST(Prepare, LeavesOutWhatCannotBeAligned) {
  Burst burst = simulate(scene(160, 140), {.frames = 4, .shake = 3});
  std::mt19937 random(3);
  const size_t pixels = burst.size.pixels();
  for (size_t n = 2 * pixels; n < 3 * pixels; ++n)
    burst.samples[n] = static_cast<float>(random() % 1000) / 1000;
  const Homography last = burst.truth->homographies[3];
  const Prepared prepared = prepare(burst, Colours::Rgb, {}, 2);
  EXPECT_EQ(burst.frames(), 3);
  EXPECT_EQ(prepared.homographies.size(), 3u);
  EXPECT_EQ(burst.samples.size(), 3 * pixels);
  EXPECT_EQ(burst.truth->homographies[2], last);
  ASSERT_EQ(burst.notes.size(), 1u);
  EXPECT_NE(burst.notes[0].find("frame 2 is left out"), std::string::npos);
}

TEST(Prepare, KeepsIdenticalFramesWithoutFeatures) {
  Burst burst;
  burst.size = {32, 32};
  burst.names = {"a", "b"};
  burst.samples.assign(2 * 32 * 32, 0.5f);
  const Prepared prepared = prepare(burst, Colours::Rgb, {}, 2);
  EXPECT_EQ(burst.frames(), 2);
  EXPECT_EQ(prepared.homographies[1], Homography{});
  for (const float value : prepared.average) EXPECT_NEAR(value, 0.5, 1e-3);
}

TEST(Average, OfOneFrameIsThatFrame) {
  const auto picture = scene(40, 30);
  const FrameSize size{40, 30};
  BicubicAverage average(size);
  average.add(picture.planes, {});
  average.add(picture.planes, {});
  const std::vector<float> mean = average.take();
  for (size_t n = 0; n < mean.size(); ++n) EXPECT_NEAR(mean[n], picture.planes[n], 1e-6);
}

TEST(Average, UndoesWholeShifts) {
  const auto picture = scene(44, 30);
  const FrameSize size{40, 30};
  std::vector<float> first, moved;
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 30; ++y) {
      for (int x = 0; x < 40; ++x) {
        first.push_back(picture.at(x, y, c));
        moved.push_back(picture.at(x + 3, y, c));
      }
    }
  }
  Homography shift{};
  shift[2] = 3 / size.scale();
  BicubicAverage average(size);
  average.add(first, {});
  average.add(moved, shift);
  const std::vector<float> mean = average.take();
  for (size_t n = 0; n < mean.size(); ++n) EXPECT_NEAR(mean[n], first[n], 1e-5);
}

// A random point of the objective and random frames, including positions beyond the picture.
struct Point {
  Shape shape;
  std::vector<double> x;
  std::vector<float> samples;
};

Point random_point(const Shape& shape, double strength) {
  std::mt19937 random(17);
  const auto unit = [&] { return static_cast<double>(random() % 65536) / 65536; };
  Point point{shape, {}, {}};
  for (size_t n = 0; n < shape.image_elems(); ++n) point.x.push_back(static_cast<float>(unit()));
  for (int n = 0; n < shape.frames; ++n) {
    for (const double h : some_homography(100 + static_cast<unsigned>(n), strength))
      point.x.push_back(static_cast<float>(h));
  }
  for (size_t n = 0; n < static_cast<size_t>(shape.frames) * shape.size.pixels(); ++n)
    point.samples.push_back(static_cast<float>(unit()));
  return point;
}

template <typename T>
std::vector<double> gradient_at(Evaluator<T>& evaluator, const Point& point, double* loss) {
  evaluator.set_frames(point.samples);
  std::vector<T> x(point.x.begin(), point.x.end()), gradient(x.size());
  *loss = evaluator.evaluate(x, gradient);
  return {gradient.begin(), gradient.end()};
}

// The reference also has a gradient by the first homography, which the evaluator keeps fixed.
std::vector<double> without_first(const Shape& shape, std::vector<double> gradient) {
  std::fill_n(gradient.begin() + static_cast<long>(shape.image_elems()), homography_params, 0.0);
  return gradient;
}

void expect_near(std::span<const double> own, std::span<const double> exact, double limit) {
  EXPECT_LE(apps::relative_error(own, exact), limit);
}

// Smooths along all three opponent colours and green, with different weights.
Smoothness smoothness(double weight) {
  Smoothness all;
  for (const auto& axis : axes_of(Colours::Opponent)) all.push_back({axis, weight *= 1.5});
  all.push_back({{0, 1, 0}, weight});
  return all;
}

class ObjectiveTest : public testing::TestWithParam<double> {};

TEST_P(ObjectiveTest, IsThatOfTheReference) {
  const Shape shape{frame_size, 4};
  const Point point = random_point(shape, GetParam());
  const auto exact = reference::objective(shape, smoothness(0.02), point.x, point.samples);
  const auto expected = without_first(shape, exact.gradient);
  const size_t image = shape.image_elems();
  double loss = 0;
  Evaluator<double> in_double(shape, smoothness(0.02), {}, 2);
  const auto wide = gradient_at(in_double, point, &loss);
  EXPECT_NEAR(loss, exact.loss, 1e-11 * exact.loss);
  expect_near(std::span(wide).first(image), std::span(expected).first(image), 1e-11);
  expect_near(std::span(wide).subspan(image), std::span(expected).subspan(image), 1e-11);
  Evaluator<float> in_float(shape, smoothness(0.02), {}, 2);
  const auto own = gradient_at(in_float, point, &loss);
  EXPECT_NEAR(loss, exact.loss, 1e-5 * exact.loss);
  expect_near(std::span(own).first(image), std::span(expected).first(image), 1e-3);
  expect_near(std::span(own).subspan(image), std::span(expected).subspan(image), 1e-3);
}

// Motions from shifts of a pixel to horizons within the frames.
INSTANTIATE_TEST_SUITE_P(Motions, ObjectiveTest, testing::Values(0.05, 0.3, 1.5));

TEST(Objective, WithoutMotionOrSmoothnessIsThatOfTheReference) {
  for (const int frames : {1, 3}) {
    const Shape shape{{18, 16}, frames};
    const Point point = random_point(shape, frames == 1 ? 0 : 0.05);
    const auto exact = reference::objective(shape, {}, point.x, point.samples);
    const auto expected = without_first(shape, exact.gradient);
    Evaluator<double> evaluator(shape, {}, {}, 2);
    double loss = 0;
    const auto own = gradient_at(evaluator, point, &loss);
    EXPECT_NEAR(loss, exact.loss, 1e-11 * exact.loss);
    expect_near(own, expected, 1e-11);
  }
}

TEST(Objective, WhatDoesNotMoveHasNoGradient) {
  const Shape shape{{20, 16}, 3};
  const Point point = random_point(shape, 0.05);
  const size_t image = shape.image_elems();
  double loss = 0;
  Evaluator<double> all(shape, smoothness(0.01), {}, 2);
  const auto whole = gradient_at(all, point, &loss);
  Evaluator<double> picture(shape, smoothness(0.01), {true, false}, 2),
      motion(shape, smoothness(0.01), {false, true}, 2);
  const auto by_picture = gradient_at(picture, point, &loss);
  const auto by_motion = gradient_at(motion, point, &loss);
  expect_near(std::span(by_picture).first(image), std::span(whole).first(image), 1e-12);
  expect_near(std::span(by_motion).subspan(image), std::span(whole).subspan(image), 1e-12);
  const auto is_zero = [](double v) { return v == 0; };
  EXPECT_TRUE(
      std::all_of(by_picture.begin() + static_cast<long>(image), by_picture.end(), is_zero));
  EXPECT_TRUE(
      std::all_of(by_motion.begin(), by_motion.begin() + static_cast<long>(image), is_zero));
}

TEST(Objective, SaysWhatItLeavesOut) {
  EXPECT_TRUE(left_out({frame_size, 3}, smoothness(0.1), {}).empty());
  EXPECT_EQ(left_out({frame_size, 1}, {}, {}).size(), 2u);
  EXPECT_EQ(left_out({frame_size, 3}, smoothness(0.1), {false, true}).size(), 1u);
  EXPECT_EQ(left_out({frame_size, 3}, {}, {true, false}).size(), 2u);
}

TEST(Checks, GradientsAreRight) {
  const Burst burst = simulate(scene(80, 70), {.frames = 3, .shake = 2});
  const auto rows = check_gradients(burst, 1);
  ASSERT_EQ(rows.size(), 2u);
  for (const auto& row : rows) {
    EXPECT_LE(row.in_double, apps::gradient_limit_double) << row.input << " by " << row.method;
    EXPECT_LE(row.in_float, apps::gradient_limit_float) << row.input;
  }
}

TEST(Checks, ExtremesStayFinite) {
  const Burst burst = simulate(scene(80, 70), {.frames = 3, .shake = 2});
  const auto rows = check_stability(burst, 1, 2);
  ASSERT_GE(rows.size(), 10u);
  for (const auto& row : rows) {
    EXPECT_LE(row.primal_error, 1e-2) << row.name;
    EXPECT_TRUE(std::isfinite(row.gradient_error)) << row.name;
  }
}

TEST(Quality, CountsWhatEveryFrameSees) {
  const FrameSize size{10, 8};
  Truth truth;
  truth.planes.assign(3 * size.pixels(), 0.5f);
  truth.border = 2;
  std::vector<float> planes(truth.planes.size(), 0.6f);
  EXPECT_NEAR(psnr_db(planes, truth, size), 20, 1e-4);
  planes[0] = 100;  // within the border
  EXPECT_NEAR(psnr_db(planes, truth, size), 20, 1e-4);
  planes[3 * 10 + 5] = 0.5f;
  EXPECT_GT(psnr_db(planes, truth, size), 20);
}

}  // namespace

// Tests lens: paraxial numbers of the patent, the pipeline against the reference, exact images of conics, vanishing
// features, and the program itself.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/images.h"
#include "common/process.h"
#include "lens/evaluator.h"
#include "lens/paraxial.h"
#include "lens/reference_trace.h"
#include "lens/scene.h"
#include "lens/shorten.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using lens::Lens;
using lens::Surface;

const char* const tessar_file = LENS_PRESCRIPTIONS "/tessar_1903.json";

// A plano-convex lens whose rear surface focuses light from the axis into exactly one point: a hyperboloid with k =
// -n^2 (R. Descartes, La Geometrie, 1637, book 2).
Lens perfect_on_axis() {
  Lens lens;
  lens.name = "hyperboloid";
  lens.f_number = 2;
  lens.half_field_degrees = 1;
  Surface front{.spacing = 5, .index = 1.5}, stop{.stop = true};
  Surface back{.curvature = -1.0 / 50, .conic = -2.25, .spacing = 100};
  lens.surfaces = {stop, front, back};
  return lens;
}

double largest(const std::vector<double>& values) {
  double most = 0;
  for (const double v : values) most = std::max(most, std::abs(v));
  return most;
}

TEST(AppLens, TheTessarHasThePatentsFocalLengthAndAperture) {
  const Lens tessar = lens::read_lens(tessar_file);
  const lens::Paraxial p = lens::paraxial(tessar);
  // The patent prints 1; its three digits give 0.9925 (the scale is 100).
  EXPECT_NEAR(p.focal_length(), 99.25, 0.02);
  EXPECT_NEAR(p.back_focus, 90.7, 0.05);
  EXPECT_EQ(tessar.f_number, 5.5);
  // The blue image lies within 0.5 % of the yellow one: the lens is an achromat.
  EXPECT_NEAR(lens::paraxial(tessar, lens::line_F).back_focus, p.back_focus, 0.5);
  EXPECT_NEAR(tessar.index(0, lens::line_D), 1.61132, 1e-9);
  EXPECT_NEAR(tessar.index(0, lens::line_F), 1.61870, 1e-9);
}

TEST(AppLens, AFastAxialRayOfTheTessarLeavesWithItsFNumber) {
  // The sine of the angle at the image is 1 / (2 N), apart from aberrations.
  const Lens tessar = lens::read_lens(tessar_file);
  const double radius = lens::paraxial(tessar).focal_length() / tessar.f_number / 2;
  const auto ray = lens::trace_ray(tessar, 0, 0, 1, radius, lens::line_d);
  ASSERT_EQ(ray.fate, lens::Fate::Arrived);
  const auto &a = ray.path[ray.path.size() - 2], &b = ray.path.back();
  const double sine = std::abs(b[1] - a[1]) / std::hypot(b[1] - a[1], b[2] - a[2]);
  EXPECT_NEAR(1 / (2 * sine), 5.5, 0.03);
}

TEST(AppLens, AHyperboloidImagesTheAxisInOnePoint) {
  Lens lens = perfect_on_axis();
  EXPECT_NEAR(lens::paraxial(lens).focal_length(), 100, 1e-9);
  for (const double height : {0.1, 0.5, 1.0}) {
    const auto ray = lens::trace_ray(lens, 0, 0.6 * height, 0.8 * height, 25, lens::line_d);
    ASSERT_EQ(ray.fate, lens::Fate::Arrived);
    EXPECT_NEAR(std::hypot(ray.x(), ray.y()), 0, 1e-9);
  }
  // A spherical surface does not focus into one point.
  lens.surfaces[2].conic = 0;
  EXPECT_GT(std::abs(lens::trace_ray(lens, 0, 0, 1, 25, lens::line_d).y()), 0.5);
}

TEST(AppLens, RaysMissAndAreTotallyReflected) {
  Lens lens = perfect_on_axis();
  lens.surfaces[1].curvature = 1.0 / 20;
  EXPECT_EQ(lens::trace_ray(lens, 0, 0, 1, 25, lens::line_d).fate, lens::Fate::Missed);
  lens = perfect_on_axis();
  lens.surfaces[2] = {.curvature = -1.0 / 26, .spacing = 100};
  EXPECT_EQ(lens::trace_ray(lens, 0, 0, 1, 25, lens::line_d).fate, lens::Fate::TotallyReflected);
  lens.surfaces[2].semi_aperture = 24;
  EXPECT_EQ(lens::trace_ray(lens, 0, 0, 1, 25, lens::line_d).fate, lens::Fate::Vignetted);
}

TEST(AppLens, ThePupilsRuleIntegratesPolynomials) {
  // Mean values over the unit disc: 1/2 for radius^2, 1/24 for x^2 y^2.
  double weight = 0, square = 0, product = 0;
  for (const auto& p : lens::pupil_points(3, 6)) {
    weight += p.weight;
    square += p.weight * (p.x * p.x + p.y * p.y);
    product += p.weight * p.x * p.x * p.y * p.y;
  }
  EXPECT_NEAR(weight, 1, 1e-14);
  EXPECT_NEAR(square, 0.5, 1e-14);
  EXPECT_NEAR(product, 1.0 / 24, 1e-14);
}

// Compares every ray of the pipeline with the reference, on the lens with all features, moved away from its start.
TEST(AppLens, ThePipelineTracesAsTheReferenceDoes) {
  const Lens tessar = lens::read_lens(tessar_file);
  const lens::Scene scene = lens::make_scene(tessar, {.optimize = lens::groups, .fields = 3});
  std::vector<double> x = lens::start_of(scene);
  for (size_t n = 0; n < x.size(); ++n) x[n] += 0.3 * std::sin(5.0 * static_cast<double>(n));
  const Lens moved = lens::lens_at(scene, x);
  lens::LensModel model(scene, retrograde::Float(64));
  retrograde::Buffer<double> variables(static_cast<int>(x.size()));
  std::copy(x.begin(), x.end(), variables.begin());
  model.variables.set(variables);
  const auto points = lens::pupil_points(scene.rings, scene.spokes);
  const retrograde::Realization image =
      model.image.realize({static_cast<int>(points.size()), 3, 3});
  const retrograde::Buffer<double> at_x = image[0], at_y = image[1], weight = image[2];
  int whole = 0, lost = 0;
  for (int w = 0; w < 3; ++w) {
    for (int f = 0; f < 3; ++f) {
      for (int p = 0; p < static_cast<int>(points.size()); ++p) {
        const auto ray = lens::trace_ray(moved, scene.fields_degrees[f], points[p].x, points[p].y,
                                         scene.pupil_radius, scene.wavelengths[w]);
        if (ray.fate == lens::Fate::Arrived) {
          EXPECT_NEAR(at_x(p, f, w), ray.x(), 1e-9);
          EXPECT_NEAR(at_y(p, f, w), ray.y(), 1e-9);
          whole += weight(p, f, w) == 1;
        } else {
          EXPECT_EQ(weight(p, f, w), 0);
          ++lost;
        }
      }
    }
  }
  EXPECT_GT(whole, 120);
  EXPECT_GT(lost, 20);
}

// A scene for derivatives of the complete pipeline, away from the kinks of its hinge functions.
class AppLensDerivatives : public testing::Test {
 protected:
  AppLensDerivatives() {
    for (size_t n = 0; n < x_.size(); ++n)
      x_[n] += 0.1 + 0.05 * std::cos(3.0 * static_cast<double>(n));
  }
  const lens::Scene scene_ =
      lens::make_scene(lens::read_lens(tessar_file), {.optimize = lens::groups, .fields = 3});
  lens::Evaluator evaluator_{scene_, retrograde::Float(64)};
  std::vector<double> x_ = lens::start_of(scene_);
};

TEST_F(AppLensDerivatives, AgreeWithDifferences) {
  const size_t size = x_.size();
  std::vector<double> gradient(size), at = x_;
  evaluator_.loss(x_, gradient);
  double worst = 0;
  const double step = 1e-5;
  for (size_t n = 0; n < size; ++n) {
    at[n] = x_[n] + step;
    const double above = evaluator_.loss(at, {});
    at[n] = x_[n] - step;
    const double below = evaluator_.loss(at, {});
    at[n] = x_[n];
    worst = std::max(worst, std::abs((above - below) / 2 / step - gradient[n]));
  }
  EXPECT_LT(worst, 1e-6 * largest(gradient));
}

// Uses a small lens, because the Hessian-vector product of a Tessar takes seconds to compile.
TEST(AppLensHessian, ProductsAgreeWithDifferencesOfGradients) {
  Lens singlet = perfect_on_axis();
  singlet.half_field_degrees = 8;
  singlet.surfaces[2].dispersion = 0.004;
  const auto scene = lens::make_scene(singlet, {.optimize = lens::groups, .fields = 2});
  lens::Evaluator evaluator(scene, retrograde::Float(64));
  std::vector<double> x = lens::start_of(scene), up(x.size()), down(x.size()), product(x.size());
  std::vector<double> v(x.size()), at(x.size());
  const double step = 1e-5;
  for (size_t n = 0; n < x.size(); ++n) {
    x[n] += 0.1 + 0.05 * std::cos(3.0 * static_cast<double>(n));
    v[n] = std::sin(2.0 * static_cast<double>(n) + 1);
  }
  for (size_t n = 0; n < x.size(); ++n) at[n] = x[n] + step * v[n];
  evaluator.loss(at, up);
  for (size_t n = 0; n < x.size(); ++n) at[n] = x[n] - step * v[n];
  evaluator.loss(at, down);
  evaluator.hessian_product(x, v, product);
  double worst = 0;
  for (size_t n = 0; n < x.size(); ++n)
    worst = std::max(worst, std::abs((up[n] - down[n]) / 2 / step - product[n]));
  EXPECT_LT(worst, 1e-6 * largest(product));
}

TEST_F(AppLensDerivatives, AreFiniteWhereNoRayArrives) {
  std::vector<double> gradient(x_.size());
  for (const double curvature : {0.2, -0.2, 10.0, 1e4}) {
    std::vector<double> x = x_;
    for (size_t n = 0; n < x.size(); ++n) {
      if (scene_.variables[n].group == "curvatures") x[n] = curvature / scene_.variables[n].scale;
    }
    EXPECT_TRUE(std::isfinite(evaluator_.loss(x, gradient))) << curvature;
    for (const double g : gradient) EXPECT_TRUE(std::isfinite(g)) << curvature;
  }
}

TEST(AppLensFeatures, WhatASceneDoesNotUseIsNotBuilt) {
  const Lens tessar = lens::read_lens(tessar_file);
  const auto operations = [&](const lens::SceneOptions& options, const Lens& of) {
    const lens::Scene scene = lens::make_scene(of, options);
    lens::LensModel model(scene, retrograde::Float(64));
    const auto d = retrograde::propagate_adjoints(model.loss, {.wrt = {model.variables}});
    return d.operations().gradient.operations().value().value_or(0);
  };
  Lens bare = tessar;
  for (Surface& surface : bare.surfaces) surface.semi_aperture = 0;
  bare.half_field_degrees = 5;
  const auto all = operations({.optimize = lens::groups}, tessar);
  const auto spheres = operations({.optimize = {"curvatures", "spacings", "indices"}}, tessar);
  const auto one_colour = operations({.optimize = lens::groups, .wavelengths = 1}, tessar);
  const auto rimless = operations({.optimize = lens::groups}, bare);
  const auto spacings = operations({.optimize = {"spacings"}}, tessar);
  EXPECT_LT(spheres, 0.9 * all);
  EXPECT_LT(one_colour, 0.4 * all);
  EXPECT_LT(rimless, 0.95 * all);
  EXPECT_LT(spacings, 0.8 * spheres);
  const auto scene = lens::make_scene(bare, {.optimize = {"spacings"}, .wavelengths = 1});
  EXPECT_EQ(lens::left_out(scene).size(), 6u);
  const auto whole = lens::make_scene(tessar, {.optimize = lens::groups});
  EXPECT_EQ(lens::left_out(whole).size(), 0u);
}

class AppLensProgram : public testing::Test {
 protected:
  apps::Outcome run(std::vector<std::string> more) {
    std::vector<std::string> command{LENS_PROGRAM, "--input", tessar_file, "--output",
                                     out().string()};
    command.insert(command.end(), more.begin(), more.end());
    return apps::run_program(command);
  }
  nlohmann::json report() {
    std::ifstream file(out() / "report.json");
    return nlohmann::json::parse(file);
  }
  fs::path out() const { return folder_.path() / "out"; }
  const TemporaryFolder folder_;
};

TEST_F(AppLensProgram, ShortensDrawsAndReports) {
  const auto outcome = run({"--steps", "1500", "--shorter", "2", "--stages", "2", "--explain"});
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("left out: terms of conics of 7 surfaces"), std::string::npos)
      << outcome.output;
  const auto own = report()["lens"];
  EXPECT_GE(own["shorter_percent"], 2.0);
  EXPECT_NEAR(own["focal_length_after"].get<double>(), own["focal_length_before"].get<double>(),
              0.3);
  EXPECT_LT(own["spot_after_um"], 1.5 * own["spot_before_um"].get<double>());
  for (const char* picture :
       {"lens_before.png", "lens_after.png", "spots.png", "error_vs_time.png"})
    EXPECT_GT(apps::read_image(out() / picture).width, 400) << picture;
  // The result is a valid prescription again.
  EXPECT_NEAR(lens::read_lens(out() / "result.json").length(), report()["numbers"][0]["value"],
              1e-3);
}

TEST_F(AppLensProgram, GoesOnWhereItWas) {
  ASSERT_EQ(run({"--steps", "40", "--seconds", "0.001"}).status, 0);
  const auto outcome = run({"--steps", "40", "--resume"});
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  const auto other = run({"--steps", "40", "--resume", "--optimize", "spacings"});
  EXPECT_EQ(other.status, 1);
  EXPECT_NE(other.output.find("the state must have \"numbers\" of 8 numbers"), std::string::npos)
      << other.output;
}

// The signal arrives during the optimization: the program writes the best result so far, and its status is 0.
TEST_F(AppLensProgram, StopsInGoodOrder) {
  const apps::Outcome outcome = apps::run_program(
      {"timeout", "--preserve-status", "-s", "INT", "3", LENS_PROGRAM, "--input", tessar_file,
       "--output", out().string(), "--steps", "1000000", "--method", "adam", "--stages", "1"});
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("; it was stopped"), std::string::npos) << outcome.output;
  EXPECT_EQ(report()["stopped"], true);
  EXPECT_TRUE(fs::exists(out() / "result.json"));
  EXPECT_TRUE(fs::exists(out() / "state.bin"));
}

}  // namespace

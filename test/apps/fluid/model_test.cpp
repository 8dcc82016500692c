// Tests the model of fluid: a frame has the properties of Stam's method, its adjoint is right, and the reverse sweep
// gives the same bits for any number of kept states.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <numeric>
#include <vector>

#include "checkpoints.h"
#include "common/checks.h"
#include "control.h"
#include "diagnostics/error.h"
#include "gradient_check.h"
#include "memory_plan.h"
#include "smoke.h"
#include "stability_check.h"
#include "support/temporary_folder.h"

namespace {

using namespace fluid;

// A blob on the left that is to become one on the right.
Scene scene_of(int width, int height, int frames, int nodes) {
  Scene scene;
  scene.shape = {.width = width, .height = height, .force_width = nodes, .force_height = nodes};
  scene.frames = frames;
  const auto blob = [&](double at_x, double at_y) {
    std::vector<float> density(static_cast<size_t>(scene.shape.cells()));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double d = std::hypot((x + 0.5) / width - at_x, (y + 0.5) / height - at_y);
        density[y * width + x] = static_cast<float>(std::exp(-20 * d * d));
      }
    }
    return density;
  };
  scene.start = blob(0.35, 0.5);
  scene.target = blob(0.6, 0.4);
  return scene;
}

Scene with_all_stages(Scene scene) {
  scene.shape.has_viscosity = scene.shape.has_diffusion = true;
  scene.physics = {0.05, 1e-3, 1e-4};
  scene.wanted = {true, true, true, true};
  return scene;
}

template <typename T>
double sum(const retrograde::Buffer<T>& b) {
  return std::accumulate(b.data(), b.data() + b.number_of_elements(), 0.0);
}

double worst_divergence(const State<double>& s) {
  double worst = 0;
  for (int y = 0; y < s.density.height(); ++y) {
    for (int x = 0; x < s.density.width(); ++x) {
      worst = std::max(worst, std::abs(s.x(x + 1, y) - s.x(x, y) + s.y(x, y + 1) - s.y(x, y)));
    }
  }
  return worst;
}

// ---- checkpoints ----

struct Walk {
  int64_t advanced = 0;
  bool legal = true;
};

Walk walk(int frames, int slots) {
  std::vector<int> kept(slots, -1);
  kept[0] = 0;
  int now = -1, next = frames - 1;
  Walk found;
  run_backward(frames, slots, [&](const Action& a) {
    const bool has_slot = a.slot >= 0 && a.slot < slots;
    switch (a.kind) {
      case Action::Kind::Load:
        found.legal &= has_slot && kept[a.slot] == a.frame;
        now = a.frame;
        break;
      case Action::Kind::Save:
        found.legal &= has_slot && a.slot > 0 && now == a.frame;
        if (has_slot) kept[a.slot] = a.frame;
        break;
      case Action::Kind::Advance:
        found.legal &= now == a.frame;
        ++now;
        ++found.advanced;
        break;
      case Action::Kind::Reverse:
        found.legal &= now == a.frame && next == a.frame;
        --next;
    }
  });
  found.legal &= next == -1;
  return found;
}

TEST(FluidCheckpoints, RunEveryFrameBackwardInOrderFromAStateThatIsThere) {
  for (int frames = 1; frames <= 60; ++frames) {
    for (int slots = 1; slots <= 12; ++slots) {
      EXPECT_TRUE(walk(frames, slots).legal) << frames << " frames, " << slots << " slots";
    }
  }
}

// The smallest number of frames, by trying every split of every length.
TEST(FluidCheckpoints, AdvanceAsFewFramesAsPossible) {
  constexpr int most_frames = 60, most_slots = 12;
  std::vector<std::vector<int64_t>> least(most_frames + 1, std::vector<int64_t>(most_slots + 1, 0));
  for (int frames = 2; frames <= most_frames; ++frames) {
    for (int slots = 1; slots <= most_slots; ++slots) {
      int64_t best = static_cast<int64_t>(frames) * (frames - 1) / 2;
      for (int cut = 1; cut < frames && slots > 1; ++cut) {
        best = std::min(best, cut + least[frames - cut][slots - 1] + least[cut][slots]);
      }
      least[frames][slots] = best;
      EXPECT_EQ(walk(frames, slots).advanced, best) << frames << " frames, " << slots << " slots";
      EXPECT_EQ(advances(frames, slots), best) << frames << " frames, " << slots << " slots";
    }
  }
}

TEST(FluidCheckpoints, WithRoomForAllNothingIsComputedTwice) {
  EXPECT_EQ(walk(200, 1000).advanced, 199);
  EXPECT_EQ(advances(200, 200), 199);
}

// ---- a frame ----

TEST(FluidFrame, LeavesNoDivergenceAndNothingThroughTheWalls) {
  Scene scene = with_all_stages(scene_of(13, 10, 3, 4));
  scene.swirl = 1;
  Control<double> control(scene);
  const auto x = random_point(control.variables(), 3);
  int frame = 0;
  control.play(x, [&](const State<double>& s) {
    EXPECT_LT(worst_divergence(s), 1e-12) << "frame " << frame++;
    for (int y = 0; y < 10; ++y) EXPECT_EQ(std::abs(s.x(0, y)) + std::abs(s.x(13, y)), 0.0);
    for (int i = 0; i < 13; ++i) EXPECT_EQ(std::abs(s.y(i, 0)) + std::abs(s.y(i, 10)), 0.0);
  });
}

TEST(FluidFrame, EvenSmokeStaysEven) {
  Scene scene = with_all_stages(scene_of(9, 12, 4, 3));
  std::fill(scene.start.begin(), scene.start.end(), 0.75f);
  Control<double> control(scene);
  control.play(random_point(control.variables(), 5), [&](const State<double>& s) {
    for (int y = 0; y < 12; ++y) {
      for (int x = 0; x < 9; ++x) EXPECT_NEAR(s.density(x, y), 0.75, 1e-12);
    }
  });
}

TEST(FluidFrame, SmokeThatOnlyDiffusesKeepsItsAmount) {
  Scene scene = with_all_stages(scene_of(12, 9, 5, 3));
  scene.physics.diffusion = 0.02;
  Control<double> control(scene);
  std::vector<double> amounts, peaks;
  control.play(control.variables().start(), [&](const State<double>& s) {
    amounts.push_back(sum(s.density));
    peaks.push_back(*std::max_element(s.density.data(), s.density.data() + 12 * 9));
  });
  for (size_t n = 1; n < amounts.size(); ++n) {
    EXPECT_NEAR(amounts[n], amounts[0], 1e-10);
    EXPECT_LT(peaks[n], peaks[n - 1]);
  }
}

// A cosine is an eigenvector: a step of implicit diffusion divides it by 1 + time_step diffusion L.
TEST(FluidFrame, AWaveOfSmokeFadesAsTheImplicitStepSays) {
  constexpr int n = 16;
  Scene scene = with_all_stages(scene_of(n, n, 1, 3));
  scene.physics.diffusion = 0.5;
  const double angle = std::numbers::pi * 3 / n;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      scene.start[y * n + x] = static_cast<float>(1 + std::cos(angle * (x + 0.5)));
    }
  }
  Control<double> control(scene);
  const double rate = scene.physics.time_step * scene.physics.diffusion * n * n;
  const double fades = 1 / (1 + rate * (2 - 2 * std::cos(angle)));
  int frame = 0;
  control.play(control.variables().start(), [&](const State<double>& s) {
    const double left = frame++ == 0 ? 1 : fades;
    for (int x = 0; x < n; ++x) {
      EXPECT_NEAR(s.density(x, 5), 1 + left * std::cos(angle * (x + 0.5)), 1e-6);
    }
  });
}

TEST(FluidFrame, IterationsComeNearToTheDirectSolution) {
  Scene direct = with_all_stages(scene_of(6, 5, 2, 2));
  direct.physics = {0.05, 0, 1e-2};
  direct.shape.has_viscosity = direct.wanted.viscosity = false;
  Scene iterated = direct;
  iterated.shape.solver = Solver::Jacobi;
  iterated.shape.iterations = 10;
  Control<double> a(direct), b(iterated);
  const auto x = random_point(a.variables(), 7);
  std::vector<double> exact, near;
  const auto keep = [](std::vector<double>& to) {
    return [&to](const State<double>& s) { to.assign(s.density.data(), s.density.data() + 30); };
  };
  a.play(x, keep(exact));
  b.play(x, keep(near));
  EXPECT_LT(apps::relative_error(near, exact), 0.05);
  EXPECT_GT(apps::relative_error(near, exact), 0.0);
}

TEST(FluidFrame, StagesThatNothingNeedsAreNotBuilt) {
  const Scene all = with_all_stages(scene_of(8, 8, 2, 3));
  Scene few = scene_of(8, 8, 2, 8);
  const FrameAdjoint with(all.shape, retrograde::Float(32), all.wanted);
  const FrameAdjoint without(few.shape, retrograde::Float(32), few.wanted);
  EXPECT_LT(without.derivative.funcs().size(), with.derivative.funcs().size());
  EXPECT_EQ(with.frame.left_out().size(), 0u);
  const auto lines = without.frame.left_out();
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_NE(lines[0].find("spreading of the force"), std::string::npos);
  EXPECT_NE(lines[1].find("viscosity"), std::string::npos);
  EXPECT_NE(lines[2].find("diffusion"), std::string::npos);
}

// ---- gradients ----

void expect_right_gradients(const Scene& scene, size_t groups) {
  const auto rows = check_gradients(scene, 11);
  ASSERT_EQ(rows.size(), groups);
  for (const apps::GradientRow& row : rows) {
    EXPECT_LE(row.in_double, apps::gradient_limit_double) << row.input;
    EXPECT_LE(row.in_float, apps::gradient_limit_float) << row.input;
  }
}

TEST(FluidGradient, OfEverythingIsRight) {
  expect_right_gradients(with_all_stages(scene_of(14, 11, 4, 4)), 4);
}

TEST(FluidGradient, OfAForceInEachCellIsRight) {
  Scene scene = scene_of(9, 9, 3, 9);
  expect_right_gradients(scene, 1);
}

TEST(FluidGradient, WithoutAForceIsRight) {
  Scene scene = with_all_stages(scene_of(10, 12, 4, 3));
  scene.shape.has_force = false;
  scene.wanted = {false, true, true, true};
  scene.swirl = 1;
  expect_right_gradients(scene, 3);
}

TEST(FluidGradient, ThroughIterationsIsRight) {
  Scene scene = with_all_stages(scene_of(7, 8, 3, 3));
  scene.shape.solver = Solver::Jacobi;
  scene.shape.iterations = 2;
  expect_right_gradients(scene, 4);
}

TEST(FluidGradient, HasTheSameBitsForEveryNumberOfKeptStates) {
  Control<float> control(with_all_stages(scene_of(16, 12, 9, 4)));
  const auto x = random_point(control.variables(), 13);
  std::vector<double> all(x.size()), few(x.size());
  control.keep_states(9);
  const double loss = control.loss(x, all);
  EXPECT_EQ(control.loss(x), loss);  // and so does the loss without it
  for (const int slots : {1, 2, 3, 5}) {
    control.keep_states(slots);
    ASSERT_EQ(control.slots(), slots);
    EXPECT_EQ(control.loss(x, few), loss);
    EXPECT_EQ(std::memcmp(all.data(), few.data(), all.size() * sizeof(double)), 0) << slots;
  }
}

// ---- stability ----

TEST(FluidStability, SixDecadesOfEverythingStayFinite) {
  const auto rows =
      check_stability(with_all_stages(scene_of(9, 8, 2, 3)), 19, [](int, int, auto) {});
  ASSERT_EQ(rows.size(), 21u);
  for (const apps::StabilityRow& row : rows) {
    EXPECT_TRUE(std::isfinite(row.primal_error)) << row.name;
    EXPECT_TRUE(std::isfinite(row.gradient_error)) << row.name;
    EXPECT_FALSE(row.diverges_guarded) << row.name << " at step " << *row.diverges_guarded;
  }
}

// ---- memory ----

TEST(FluidMemory, TwoHundredFramesOf256SquaredFitIntoAGigabyte) {
  const Scene scene = scene_of(256, 256, 200, 16);
  const MemoryPlan plan = plan_memory(scene, {apps::Method::Adam}, 1000, 300);
  EXPECT_EQ(plan.slots, 200);
  EXPECT_LT(plan.slots * plan.state_mb + plan.variables_mb, 700);
}

TEST(FluidMemory, LessOfItKeepsFewerStates) {
  const Scene scene = scene_of(256, 256, 200, 16);
  const MemoryPlan plan = plan_memory(scene, {apps::Method::Adam}, 350, 300);
  EXPECT_GT(plan.slots, 10);
  EXPECT_LT(plan.slots, 100);
  EXPECT_LE(plan.slots * plan.state_mb + plan.variables_mb, 50);
}

TEST(FluidMemory, TooLittleForOneStateIsRefused) {
  const Scene scene = scene_of(256, 256, 200, 16);
  EXPECT_THROW(plan_memory(scene, {apps::Method::Adam}, 300, 300), retrograde::UserError);
  EXPECT_THROW(require_memory_for_a_frame(scene, 10), retrograde::UserError);
  EXPECT_NO_THROW(require_memory_for_a_frame(scene, 1000));
}

// ---- pictures ----

TEST(FluidSmoke, ADiscHasTheAmountOfThePicture) {
  for (const double level : {0.05, 0.3, 0.9}) {
    Smoke smoke{40, 30, std::vector<float>(1200, static_cast<float>(level))};
    EXPECT_NEAR(disc_like(smoke).total(), smoke.total(), 1e-3);
  }
}

TEST(FluidSmoke, ResamplingKeepsTheMean) {
  Smoke smoke{37, 23, {}};
  for (int n = 0; n < 37 * 23; ++n) smoke.density.push_back(static_cast<float>(n * 7 % 13) / 12);
  const double mean = smoke.total() / (37 * 23);
  for (const auto& [width, height] : {std::pair{16, 10}, {60, 40}, {37, 23}}) {
    EXPECT_NEAR(resample(smoke, width, height).total() / (width * height), mean, 1e-5);
  }
}

TEST(FluidSmoke, AnAnimationHasAllItsFrames) {
  const TemporaryFolder folder;
  Animation animation(5, 10);
  for (int n = 0; n < 5; ++n) {
    const Smoke smoke{8, 6, std::vector<float>(48, static_cast<float>(n) / 4)};
    animation.add(to_image(smoke, 2));
  }
  animation.finish(folder.path() / "a.gif");
  auto input = OIIO::ImageInput::open((folder.path() / "a.gif").string());
  ASSERT_TRUE(input);
  EXPECT_EQ(input->spec().width, 16);
  EXPECT_EQ(input->spec().height, 12);
  EXPECT_NEAR(input->spec().get_float_attribute("FramesPerSecond"), 10, 1e-3);
  int frames = 0;
  while (input->seek_subimage(frames, 0)) ++frames;
  EXPECT_EQ(frames, 5);
}

}  // namespace

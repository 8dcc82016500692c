// stability_check.cpp -- see stability_check.h.
#include "stability_check.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "control.h"
#include "diagnostics/error.h"
#include "gradient_check.h"

namespace fluid {

using retrograde::text;

namespace {

constexpr long optimizer_steps = 40;
constexpr double force_rate = 0.1;
constexpr double explosion = 10;   // as in a run: see fit.cpp
constexpr double scalar_rate = 7;  // times the variables' scale of 0.1: a factor of about two

struct Case {
  std::string name;
  Physics physics;
};

std::vector<Case> cases(const Physics& usual) {
  std::vector<Case> all;
  const auto decades = [&](const char* name, double Physics::*what, int from) {
    for (int power = from; power <= from + 6; ++power) {
      Case one{text(name, " 1e", power), usual};
      one.physics.*what = std::pow(10.0, power);
      all.push_back(one);
    }
  };
  decades("viscosity", &Physics::viscosity, -6);
  decades("diffusion", &Physics::diffusion, -6);
  decades("time step", &Physics::time_step, -4);
  return all;
}

// Has both stages and optimizes everything, so that one compiled frame serves all cases.
Scene scene_with_all(const Scene& scene) {
  Scene all = scene;
  all.wanted = {true, true, true, true};
  all.shape.has_force = all.shape.has_viscosity = all.shape.has_diffusion = true;
  if (all.physics.viscosity == 0) all.physics.viscosity = 1e-4;
  if (all.physics.diffusion == 0) all.physics.diffusion = 1e-6;
  return small_scene(all);
}

class Cases {
 public:
  explicit Cases(const Scene& scene, uint64_t seed)
      : scene_(scene),
        exact_(scene, scene.frames),
        own_(scene, scene.frames),
        x_(random_point(exact_.variables(), seed)) {
    // At the case's own values.
    std::fill(x_.begin() + static_cast<long>(exact_.variables().force_size()), x_.end(), 0.0);
  }

  apps::StabilityRow measure(const Case& one) {
    exact_.start_from(one.physics, true);
    own_.start_from(one.physics, true);
    apps::StabilityRow row{one.name};
    row.primal_error = apps::relative_error(last_density(own_), last_density(exact_));
    row.gradient_error = apps::relative_error(gradient(own_), gradient(exact_));
    row.steps = optimizer_steps;
    row.diverges_guarded = diverges(true);
    own_.start_from(one.physics, false);
    row.diverges_plain = diverges(false);
    return row;
  }

 private:
  template <typename T>
  std::vector<double> last_density(Control<T>& control) {
    std::vector<double> density;
    control.play(x_, [&](const State<T>& state) {
      const T* first = state.density.data();
      density.assign(first, first + state.density.number_of_elements());
    });
    return density;
  }

  template <typename T>
  std::vector<double> gradient(Control<T>& control) {
    std::vector<double> g(x_.size());
    control.loss(x_, g);
    return g;
  }

  std::optional<long> diverges(bool safeguard) {
    apps::Problem problem;
    problem.size = x_.size();
    problem.evaluate = [&](std::span<const double> x, std::span<double> g) {
      return own_.loss(x, g);
    };
    apps::MinimizeOptions with;
    with.method = apps::Method::Adam;
    with.steps = optimizer_steps;
    const size_t force = exact_.variables().force_size();
    apps::Adam adam({{force, force_rate}, {x_.size() - force, scalar_rate}},
                    {.safeguard = safeguard, .explosion = explosion});
    with.moments = &adam;
    // Refused steps are undone, so only the points that the run kept count.
    std::vector<apps::LossSample> kept;
    double lowest = INFINITY;
    for (const auto& s : apps::minimize(problem, x_, with).series) {
      const bool refused = !std::isfinite(s.loss) || s.loss > explosion * lowest;
      if (!safeguard || !refused) kept.push_back(s);
      lowest = std::fmin(lowest, s.loss);
    }
    return apps::diverging_step(kept);
  }

  Scene scene_;
  Control<double> exact_;
  Control<float> own_;
  std::vector<double> x_;
};

}  // namespace

std::vector<apps::StabilityRow> check_stability(
    const Scene& scene, uint64_t seed,
    const std::function<void(int, int, const std::string&)>& shown) {
  const Scene small = scene_with_all(scene);
  Cases measured(small, seed);
  const std::vector<Case> all = cases(small.physics);
  std::vector<apps::StabilityRow> rows;
  for (const Case& one : all) {
    shown(static_cast<int>(rows.size()), static_cast<int>(all.size()), one.name);
    rows.push_back(measured.measure(one));
  }
  return rows;
}

}  // namespace fluid
